#include "pf_resampling_core/filters/fastslam/global_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

#include "pf_resampling_core/filters/fastslam/memory/landmark_index.hpp"
#include "pf_resampling_core/models/point_alignment.hpp"

namespace pf_resampling {
namespace {

// Sigmas within which two places are one.
constexpr double kGate = 3.0;
// Landmarks that have to be among what was seen, and their share of the sightings: what is not in
// the map is seen, too.
constexpr int kLeastMatches = 4;
constexpr double kLeastShare = 0.7;
// Another place for the robot must explain fewer than this share of the sightings, or of the
// landmarks, that the best one does; or explain them so much worse: a hundred times less likely.
constexpr double kClear = 0.8;
constexpr double kWorse = 9.2;  // of the sum of squared distances
// Pairs of places that are tried: those farthest apart tell the heading best.
constexpr std::size_t kMostPairs = 12;
// Answers that are looked at in a scan, whatever the size of the map; about half a second.
constexpr std::size_t kMostAnswers = 100000;
// Landmarks of a map beyond which their pairs alone would take longer.
constexpr std::size_t kMostLandmarks = 5000;
// Places that are told apart: those seen most often.
constexpr std::size_t kMostSeenPlaces = 30;
// Two answers are the same robot's if they put what was seen no farther apart.
constexpr double kSame = 1.0;  // m

/// The landmarks of a map, to look for those near a place.
class Landmarks {
 public:
  explicit Landmarks(const std::vector<LandmarkEstimate>& map) : map_(map) {
    for (std::size_t i = 0; i < map.size(); ++i) {
      index_.place(static_cast<int>(i), map[i].mean);
      largest_ = std::max(largest_, std::sqrt(0.5 * map[i].covariance.trace()));
    }
  }

  /// The nearest within `gate` sigmas of both; -1 if there is none. Adds its squared distance, in
  /// sigmas, to `squares`: that of the gate if there is none.
  int nearest(const Eigen::Vector2d& place, double sigma, double* squares) const {
    int best = -1;
    double least = kGate * kGate;
    std::vector<int> near;
    index_.near(place, kGate * std::hypot(sigma, largest_), &near);
    for (const int i : near) {
      const LandmarkEstimate& landmark = map_[static_cast<std::size_t>(i)];
      const double variance = sigma * sigma + 0.5 * landmark.covariance.trace();
      const double distance = (landmark.mean - place).squaredNorm() / variance;
      if (distance < least) {
        least = distance;
        best = i;
      }
    }
    *squares += least;
    return best;
  }

 private:
  const std::vector<LandmarkEstimate>& map_;
  LandmarkIndex index_;
  double largest_ = 0.0;  // m, standard deviation
};

struct Answer {
  Pose2 correction;
  std::vector<int> landmarks;  // of each place
  int matches = 0;             // landmarks that were seen
  int sightings = 0;           // of them
  double squares = 0.0;        // of their distances, in sigmas
};

Answer answer_of(const Pose2& correction, const std::vector<SeenPlace>& places,
                 const Landmarks& landmarks) {
  Answer answer;
  answer.correction = correction;
  std::set<int> taken;
  for (const SeenPlace& place : places) {
    // Odometry may have put the same landmark to two places.
    const int landmark =
        landmarks.nearest(moved(place.place, correction), place.sigma, &answer.squares);
    answer.landmarks.push_back(landmark);
    if (landmark < 0) continue;
    answer.sightings += place.sightings;
    if (taken.insert(landmark).second) ++answer.matches;
  }
  return answer;
}

bool are_same(const Pose2& a, const Pose2& b, const std::vector<SeenPlace>& places) {
  return std::all_of(places.begin(), places.end(), [&](const SeenPlace& place) {
    return (moved(place.place, a) - moved(place.place, b)).norm() < kSame + kGate * place.sigma;
  });
}

/// Pairs of places, those farthest apart first.
std::vector<std::pair<std::size_t, std::size_t>> pairs_of(const std::vector<SeenPlace>& places) {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t a = 0; a < places.size(); ++a) {
    for (std::size_t b = a + 1; b < places.size(); ++b) pairs.emplace_back(a, b);
  }
  std::stable_sort(pairs.begin(), pairs.end(), [&](const auto& one, const auto& other) {
    return (places[one.first].place - places[one.second].place).norm() >
           (places[other.first].place - places[other.second].place).norm();
  });
  if (pairs.size() > kMostPairs) pairs.resize(kMostPairs);
  return pairs;
}

}  // namespace

PlaceMatch match_places(const std::vector<SeenPlace>& places,
                        const std::vector<LandmarkEstimate>& map, std::size_t* next_pair) {
  if (map.size() > kMostLandmarks) return {};
  const Landmarks landmarks(map);
  // What there is no time for is tried first at the next scan.
  const auto give_up = [&](std::size_t pairs_tried) -> PlaceMatch {
    if (next_pair != nullptr) *next_pair += pairs_tried;
    return {};
  };
  Answer best;
  std::vector<Answer> rivals;  // that may be; without their landmarks
  const auto is_rival = [&](const Answer& answer) {
    return answer.sightings >= kClear * best.sightings && answer.matches >= kClear * best.matches &&
           answer.squares < best.squares + kWorse;
  };
  const auto take = [&](Answer answer) {
    if (answer.sightings > best.sightings ||
        (answer.sightings == best.sightings && answer.squares < best.squares)) {
      std::swap(answer, best);
    }
    answer.landmarks.clear();
    if (answer.matches > 0 && is_rival(answer)) rivals.push_back(std::move(answer));
  };
  const auto pairs = pairs_of(places);
  const std::size_t first_pair = next_pair == nullptr ? 0 : *next_pair;
  std::size_t answers = 0;
  std::size_t tried = 0;
  for (; tried < pairs.size() && (tried == 0 || answers < kMostAnswers / 2); ++tried) {
    const auto& [a, b] = pairs[(first_pair + tried) % pairs.size()];
    const double apart = (places[a].place - places[b].place).norm();
    for (const LandmarkEstimate& first : map) {
      for (const LandmarkEstimate& other : map) {
        if (&first == &other) continue;
        const double tolerance =
            kGate *
            std::sqrt(places[a].sigma * places[a].sigma + places[b].sigma * places[b].sigma +
                      0.5 * (first.covariance.trace() + other.covariance.trace()));
        if (std::abs((first.mean - other.mean).norm() - apart) > tolerance) continue;
        if (++answers > kMostAnswers) return give_up(tried + 1);
        take(answer_of(align_points({places[a].place, places[b].place}, {first.mean, other.mean}),
                       places, landmarks));
      }
    }
  }
  if (tried < pairs.size()) give_up(tried);
  int sightings = 0;
  for (const SeenPlace& place : places) sightings += place.sightings;
  if (best.matches < kLeastMatches || best.sightings < kLeastShare * sightings) return {};
  const bool is_ambiguous = std::any_of(rivals.begin(), rivals.end(), [&](const Answer& answer) {
    return is_rival(answer) && !are_same(answer.correction, best.correction, places);
  });
  if (is_ambiguous) return {{}, true};
  return {best.landmarks, false};
}

std::optional<PoseEstimate> GlobalSearch::add(
    std::int64_t stamp, const std::vector<RangeBearingObservation>& observations,
    const Pose2& sensor, const LandmarkSensorOptions& noise,
    const std::vector<LandmarkEstimate>& map, bool with_ids) {
  const Pose2 eye = compose(robot_, sensor);
  for (const RangeBearingObservation& z : observations) {
    const double sigma =
        std::sqrt(range_variance(noise, z) + z.range * z.range * bearing_variance(noise, z));
    sightings_.add(
        {z.id, place_seen(eye, z.range, z.bearing), Eigen::Vector2d::Zero(), sigma, stamp});
  }
  sightings_.forget_before(stamp);
  if (!sightings_.are_of_several_scans()) return std::nullopt;

  std::vector<LandmarkSighting> matched;
  const auto match = [&](const LandmarkEstimate& landmark, const Eigen::Vector2d& seen,
                         double sigma) {
    const double of_both = std::sqrt(sigma * sigma + landmark.covariance.trace());
    matched.push_back({landmark.id, seen, landmark.mean, of_both});
  };
  if (with_ids) {
    for (const LandmarkSighting& sighting : sightings_.all()) {
      const auto landmark =
          std::find_if(map.begin(), map.end(), [&](const auto& l) { return l.id == sighting.id; });
      if (landmark != map.end()) match(*landmark, sighting.seen, sighting.sigma);
    }
    return relocalize(matched, robot_);
  }
  // What is seen again and again at one place is one.
  std::vector<SeenPlace> places;
  for (const LandmarkSighting& sighting : sightings_.all()) {
    const auto same = std::find_if(places.begin(), places.end(), [&](const SeenPlace& place) {
      return (place.place - sighting.seen).norm() < kGate * std::hypot(place.sigma, sighting.sigma);
    });
    if (same == places.end()) {
      places.push_back({sighting.seen, sighting.sigma, 1});
      continue;
    }
    ++same->sightings;
    same->place += (sighting.seen - same->place) / same->sightings;
    same->sigma = std::max(same->sigma, sighting.sigma);
  }
  places.erase(std::remove_if(places.begin(), places.end(),
                              [](const SeenPlace& place) { return place.sightings < 2; }),
               places.end());
  if (static_cast<int>(places.size()) < kLeastMatches) return std::nullopt;
  if (places.size() > kMostSeenPlaces) {
    std::stable_sort(places.begin(), places.end(), [](const auto& one, const auto& other) {
      return one.sightings > other.sightings;
    });
    places.resize(kMostSeenPlaces);
  }
  const PlaceMatch found = match_places(places, map, &next_pair_);
  is_ambiguous_ = found.is_ambiguous;
  if (found.landmarks.empty()) return std::nullopt;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (found.landmarks[i] < 0) continue;
    match(map[static_cast<std::size_t>(found.landmarks[i])], places[i].place, places[i].sigma);
  }
  return relocalize(matched, robot_);
}

}  // namespace pf_resampling
