#include "pf_resampling_core/filters/fastslam/landmark_changes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace pf_resampling {
namespace {

constexpr double kSamePlace = 0.25;  // m, and
constexpr std::size_t kFewOff = 3;
constexpr double kAround = 2.0;  // times how far the sensor sees
constexpr int kFewestAround = 5;
constexpr double kOffSigmas = 5.0;      // of their mean
constexpr double kApartSigmas = 4.0;    // between places of a map in the making
constexpr double kSameSigmas = 3.0;     // standard deviations, between sightings of one place
constexpr int kFewestSightings = 4;     // of a place, ...
constexpr double kShortest = 0.5;       // ... over so many s
constexpr double kVisitGap = 5.0;       // s
constexpr std::size_t kMostPlaces = 4;  // of a landmark; of misread ids there may be many
// What was seen of others, from then to so many s after, has to fit: so many sightings,
// to such a share; of landmarks that were there so many s before, or the belief may be wrong,
// unless it is so many times more certain; then few sightings are remembered, too.
constexpr double kAfter = 15.0;
constexpr double kOld = 60.0;
constexpr double kFarSigmas = 10.0;
constexpr double kFar = 2.0;  // m
constexpr int kFewestOthers = 3;
constexpr double kFitting = 0.75;
constexpr std::size_t kFewestOld = 2;  // landmarks that show how far off what is seen may be
constexpr std::size_t kMostLatest = 300;
// s after which a place that nothing confirms is forgotten: in a map that was given, and in one in
// the making, which a loop moves.
constexpr double kUnconfirmed = 600.0;
constexpr double kUnconfirmedAndMoved = 60.0;
// Of sightings in a row so many are one. Share of the landmarks that are moved.
constexpr double kPerOpinion = 4.0;
constexpr double kMoved = 0.01;
constexpr double kSure = 0.9;
constexpr double kOpen = 10.0;  // s after the last sighting
// The belief has to fit so many sightings of the last s.
constexpr double kFits = 15.0;
constexpr int kFewestFits = 3;
// Of directions that it is seen from and was: about the same, and from the side.
constexpr double kSameSide = 0.5;
constexpr double kAtTheSide = -0.5;
// From their mean, times what sightings of one place may be apart.
constexpr double kMostScatter = 2.0;
constexpr std::size_t kMostRemembered = 300000;  // sightings
constexpr int kFewestLooks = 3;
constexpr std::size_t kMostArrivals = 12;
// Share of the landmarks that are gone, and how sure one has to be.
constexpr double kGone = 0.05;
constexpr double kSurelyGone = 0.85;

int count(const std::array<int, 3>& of_sides) {
  return std::accumulate(of_sides.begin(), of_sides.end(), 0);
}

// m, between sightings of one place.
double near(double sigma) {
  return std::max(kSamePlace, kSameSigmas * sigma);
}

// What was seen of a landmark while it was in view is at one place, if it is no farther apart than
// noise is: else each would be wherever its noise has put it.
void average_visits(std::vector<MapScan>* scans) {
  struct Seen {
    double last = 0.0;
    std::vector<MapSighting*> sightings;
  };
  std::map<std::int64_t, Seen> visits;
  const auto end = [](Seen* visit) {
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const MapSighting* one : visit->sightings) mean += one->seen;
    mean /= static_cast<double>(visit->sightings.size());
    const bool is_one =
        std::all_of(visit->sightings.begin(), visit->sightings.end(), [&](const MapSighting* one) {
          return (one->seen - mean).norm() <= kMostScatter * near(one->sigma);
        });
    for (MapSighting* one : visit->sightings) {
      if (is_one) one->seen = mean;
    }
    visit->sightings.clear();
  };
  for (MapScan& scan : *scans) {
    for (MapSighting& sighting : scan.sightings) {
      Seen& visit = visits[sighting.id];
      if (!visit.sightings.empty() && scan.time > visit.last + kVisitGap) end(&visit);
      visit.last = scan.time;
      visit.sightings.push_back(&sighting);
    }
  }
  for (auto& [id, visit] : visits) end(&visit);
}

}  // namespace

void LandmarkChanges::start(const std::vector<LandmarkEstimate>& map) {
  *this = LandmarkChanges();
  is_traceable_ = map.empty();
  for (const LandmarkEstimate& estimate : map) {
    Landmark& landmark = landmarks_[estimate.id];
    landmark.is_given = true;
    landmark.home().position = estimate.mean;
    landmark.home().sigma = landmark.given_sigma = std::sqrt(0.5 * estimate.covariance.trace());
    index_.place(static_cast<int>(ids_.size()), estimate.mean);
    ids_.push_back(estimate.id);
  }
}

// A place that the filter has no landmark at goes along with the nearest landmark.
void LandmarkChanges::follow(const std::vector<LandmarkEstimate>& map) {
  std::map<std::int64_t, Eigen::Vector2d> is_at;
  for (const LandmarkEstimate& estimate : map) is_at[estimate.id] = estimate.mean;
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> shifts;  // where from, by how much
  for (const auto& [id, landmark] : landmarks_) {
    const auto found = is_at.find(id);
    const bool is_home = landmark.places.size() == 1 && count(landmark.missed) == 0;
    if (found == is_at.end() || !is_home) continue;
    shifts.emplace_back(landmark.home().position, found->second - landmark.home().position);
  }
  const auto move = [&](Eigen::Vector2d* position) {
    double least = std::numeric_limits<double>::infinity();
    Eigen::Vector2d shift = Eigen::Vector2d::Zero();
    for (const auto& [from, by] : shifts) {
      const double distance = (*position - from).squaredNorm();
      if (!(distance < least)) continue;
      least = distance;
      shift = by;
    }
    *position += shift;
  };
  for (auto& [id, landmark] : landmarks_) {
    for (Place& place : landmark.places) move(&place.position);
    // Two places of a belief that was wrong may be one.
    std::vector<Place>& places = landmark.places;
    const Eigen::Vector2d home = landmark.home().position;
    const auto other = std::remove_if(places.begin() + 1, places.end(), [&](const Place& place) {
      return (place.position - home).norm() < kSamePlace;
    });
    if (other != places.end()) landmark.missed.fill(0);
    places.erase(other, places.end());
  }
  for (std::size_t row = 0; row < ids_.size(); ++row) {
    index_.place(static_cast<int>(row), landmarks_[ids_[row]].home().position);
  }
}

void LandmarkChanges::remember(const MapScan& scan) {
  remembered_ += scan.sightings.size();
  const bool goes_on = scans_.empty() || scans_.back().step <= scan.step;
  is_traceable_ = is_traceable_ && goes_on && remembered_ < kMostRemembered;
  if (is_traceable_) {
    scans_.push_back(scan);
  } else {
    scans_.clear();
  }
}

bool LandmarkChanges::retrace(const std::vector<Pose2>& path,
                              const std::vector<LandmarkEstimate>& map) {
  if (!is_traceable_ || scans_.empty() || scans_.back().step >= path.size()) return false;
  LandmarkChanges anew;
  anew.view_ = view_;
  std::map<std::int64_t, Eigen::Vector2d> is_at;
  for (const LandmarkEstimate& estimate : map) is_at[estimate.id] = estimate.mean;
  std::vector<MapScan> scans = scans_;
  for (MapScan& scan : scans) {
    const Pose2& robot = path[scan.step];
    for (MapSighting& sighting : scan.sightings) {
      sighting.seen = moved(seen_from(scan.robot, sighting.seen), robot);
    }
    scan.eye = compose(robot, relative(scan.robot, scan.eye));
  }
  average_visits(&scans);
  for (MapScan& scan : scans) {
    for (MapSighting& sighting : scan.sightings) {
      const auto found = is_at.find(sighting.id);
      sighting.is_believed =
          found != is_at.end() && (found->second - sighting.seen).norm() <= near(sighting.sigma);
      sighting.mapped.reset();
      sighting.is_started = true;
    }
    anew.add(scan);
  }
  anew.scans_ = std::move(scans_);
  anew.remembered_ = remembered_;
  *this = std::move(anew);
  return true;
}

void LandmarkChanges::add(const MapScan& scan) {
  const double time = scan.time;
  now_ = time;
  for (const MapSighting& sighting : scan.sightings) {
    take(time, sighting, {scan.eye.x, scan.eye.y}, scan.sigma);
    if (!sighting.is_believed) continue;
    const Eigen::Vector2d there = seen_from(scan.eye, sighting.seen);
    view_.add(std::hypot(there.x(), there.y()), std::atan2(there.y(), there.x()));
  }
  look(time, scan.eye);
  for (auto id = pending_.begin(); id != pending_.end();) {
    Landmark& landmark = landmarks_[*id];
    end_visit(time, &landmark);
    std::vector<Place>& places = landmark.places;
    for (std::size_t i = 1; i < places.size(); ++i) {
      const double apart = (places[i].position - places[0].position).norm();
      confirm(*id, apart > kFar + kFarSigmas * scan.sigma, &places[i]);
    }
    const double oldest = time - (landmark.is_given ? kUnconfirmed : kUnconfirmedAndMoved);
    places.erase(std::remove_if(places.begin() + 1, places.end(),
                                [&](const Place& place) {
                                  return !place.is_confirmed && place.last < oldest;
                                }),
                 places.end());
    const bool is_settled = count(landmark.visit.looks) == 0 &&
                            std::all_of(places.begin() + 1, places.end(),
                                        [](const Place& place) { return place.is_confirmed; });
    id = is_settled ? pending_.erase(id) : std::next(id);
  }
}

void LandmarkChanges::take(double time, const MapSighting& sighting, const Eigen::Vector2d& eye,
                           double eye_sigma) {
  const auto [found, is_new] = landmarks_.try_emplace(sighting.id);
  Landmark& landmark = found->second;
  if (is_new) {
    landmark.home().position = sighting.mapped.value_or(sighting.seen);
    landmark.home().sigma = sighting.sigma;
    index_.place(static_cast<int>(ids_.size()), landmark.home().position);
    ids_.push_back(sighting.id);
    landmark.known_since = time;
  }
  const bool is_old = landmark.is_given || landmark.known_since < time - kOld;
  if (landmark.is_given && (landmark.last_seen < 0.0 || time > landmark.last_seen + kVisitGap)) {
    arrivals_.push_back(sighting.is_believed);
    if (arrivals_.size() > kMostArrivals) arrivals_.pop_front();
  }
  landmark.last_seen = time;
  const Eigen::Vector2d mapped = sighting.mapped.value_or(landmark.home().position);
  // What the filter believes is of the place that it has the landmark at, which goes along with it;
  // all else is of another place.
  const bool is_there = sighting.is_believed && !sighting.is_started;
  std::vector<Place>& places = landmark.places;
  const auto nearest = [&](const Eigen::Vector2d& position, std::size_t except) {
    std::size_t best = places.size();
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < places.size(); ++i) {
      const double distance = (places[i].position - position).norm();
      if (i == except || !(distance < least)) continue;
      best = i;
      least = distance;
    }
    return std::make_pair(best, least);
  };
  std::size_t at = nearest(mapped, places.size()).first;
  if (!is_there) {
    const auto [known, distance] = nearest(sighting.seen, sighting.is_started ? places.size() : at);
    at = known;
    if (distance > near(sighting.sigma)) {
      if (places.size() == kMostPlaces) {
        places.erase(std::min_element(
            places.begin() + 1, places.end(),
            [](const Place& one, const Place& other) { return one.sightings < other.sightings; }));
      }
      at = places.size();
      places.emplace_back();
      pending_.insert(sighting.id);
    }
  }
  // That the filter believes it to be elsewhere by now does not show that the belief is right.
  const bool is_home = (sighting.is_believed || sighting.is_started) && at == 0;
  if (sighting.is_believed || is_home) {
    ++believed_;
  } else if (belief_fits(time)) {  // else it is no misread id
    ++not_believed_;
  }
  const Eigen::Vector2d off = sighting.seen - (is_there ? mapped : landmark.home().position);
  latest_.push_back({time, sighting.id, is_home, is_old, off});
  if (latest_.size() > kMostLatest) latest_.pop_front();
  Place& place = places[at];
  if (is_there) {
    place.position = mapped;
    landmark.off += (sighting.seen - mapped - landmark.off) / ++landmark.believed;
  } else {
    place.position += (sighting.seen - place.position) / (1.0 + place.sightings);
  }
  if (at == 0) {
    if (time > place.last + kVisitGap) landmark.seen_from = landmark.seen_last_from;
    landmark.seen_last_from = (eye - place.position).normalized();
    landmark.missed.fill(0);
  }
  if (place.sightings++ == 0) place.first = place.last = time;
  const bool is_back = time > place.last + kVisitGap;
  place.visits += is_back || place.sightings == 1 ? 1 : 0;
  place.opinions += is_back ? 1.0 : 1.0 / kPerOpinion;
  place.sigma = sighting.sigma;
  place.eye_sigma = eye_sigma;
  place.last = time;
  place.is_believed = sighting.is_believed;
}

// Others are seen where they should be: so it is the landmark that is not.
void LandmarkChanges::confirm(std::int64_t id, bool is_far, Place* place) const {
  if (place->is_confirmed || !(is_far || is_many(*place))) return;
  int others = 0, fitting = 0, after = 0;
  std::map<std::int64_t, std::pair<Eigen::Vector2d, int>> off;  // of old ones: sum, sightings
  for (const Outcome& outcome : latest_) {
    if (outcome.id == id || (!is_far && !outcome.is_old)) continue;
    if (outcome.time < place->first || outcome.time > place->last + kAfter) continue;
    ++others;
    fitting += outcome.is_believed ? 1 : 0;
    after += outcome.is_believed && outcome.time > place->first ? 1 : 0;
    if (!outcome.is_old || !outcome.is_believed) continue;
    const std::pair<Eigen::Vector2d, int> none = {Eigen::Vector2d::Zero(), 0};
    auto& [sum, sightings] = off.try_emplace(outcome.id, none).first->second;
    sum += outcome.off;
    ++sightings;
  }
  place->is_confirmed = after >= kFewestOthers && fitting >= kFitting * others;
  double squares = 0.0;
  for (const auto& [other, sum] : off) squares += (sum.first / sum.second).squaredNorm();
  place->others_off = off.size() < kFewestOld
                          ? place->eye_sigma
                          : std::sqrt(squares / static_cast<double>(off.size()));
}

bool LandmarkChanges::belief_fits(double time) const {
  int fitting = 0, all = 0;
  for (auto outcome = latest_.rbegin(); outcome != latest_.rend(); ++outcome) {
    if (outcome->time < time - kFits) break;
    if (!outcome->is_old) continue;
    ++all;
    fitting += outcome->is_believed ? 1 : 0;
  }
  return fitting >= kFewestFits && fitting >= kFitting * all;
}

void LandmarkChanges::look(double time, const Pose2& eye) {
  if (!belief_fits(time)) return;
  std::vector<int> near;
  index_.near({eye.x, eye.y}, view_.range, &near);
  for (const int row : near) {
    const std::int64_t id = ids_[static_cast<std::size_t>(row)];
    Landmark& landmark = landmarks_[id];
    const Eigen::Vector2d& home = landmark.home().position;
    if (!view_.covers(seen_from(eye, home))) continue;
    // An id that was seen a few times may have been misread.
    const int sightings = landmark.home().sightings;
    if (!landmark.is_given && sightings < kFewestSightings) continue;
    const Eigen::Vector2d from = Eigen::Vector2d(eye.x, eye.y) - home;
    const Eigen::Vector2d direction = from.normalized();
    double cosine = landmark.seen_from.isZero() ? -1.0 : landmark.seen_from.dot(direction);
    const bool is_in_sight = sightings > 0 && landmark.home().last > time - kVisitGap;
    if (!is_in_sight) cosine = std::max(cosine, landmark.seen_last_from.dot(direction));
    if (sightings == 0 || (is_in_sight && landmark.seen_from.isZero())) cosine = 1.0;
    const Side side = cosine >= kSameSide ? before : cosine >= kAtTheSide ? aside : behind;
    if (is_in_sight) {
      ++looks_;
      overlooked_ += landmark.home().last < time ? 1 : 0;
    }
    if (count(landmark.visit.looks) == 0) landmark.visit.first = time;
    ++landmark.visit.looks[side];
    landmark.visit.last = time;
    pending_.insert(id);
  }
}

void LandmarkChanges::end_visit(double time, Landmark* landmark) {
  Visit& visit = landmark->visit;
  if (count(visit.looks) == 0 || time < visit.last + kVisitGap) return;
  const Place& home = landmark->home();
  const bool is_seen = home.sightings > 0 && home.last >= visit.first - kVisitGap;
  const auto side = std::find_if(visit.looks.begin(), visit.looks.end(),
                                 [](int looks) { return looks >= kFewestLooks; });
  if (side != visit.looks.end()) {
    const auto s = static_cast<std::size_t>(side - visit.looks.begin());
    ++visits_[s];
    if (!is_seen) {
      ++missed_[s];
      if (count(landmark->missed) == 0) landmark->missed_first = visit.first;
      ++landmark->missed[s];
      landmark->missed_last = visit.last;
    }
  }
  visit = {};
}

void LandmarkChanges::forget_latest() {
  latest_.clear();
  for (auto& [id, landmark] : landmarks_) {
    std::vector<Place>& places = landmark.places;
    places.erase(std::remove_if(places.begin() + 1, places.end(),
                                [](const Place& place) { return !place.is_confirmed; }),
                 places.end());
    landmark.visit = {};
    if (landmark.home().last > now_ - kFits) landmark.believed = 0;
  }
}

bool LandmarkChanges::is_many(const Place& place) const {
  return place.sightings >= kFewestSightings && place.last - place.first >= kShortest;
}

bool LandmarkChanges::map_misfits() const {
  const auto fitting = std::count(arrivals_.begin(), arrivals_.end(), true);
  return arrivals_.size() == kMostArrivals && 2 * fitting < std::ptrdiff_t(kMostArrivals);
}

// Against an id that is misread as often as others are.
double LandmarkChanges::probability_of(const Place& place) const {
  const int others = std::max(0, not_believed_ - place.sightings);
  const double misread = (others + 1.0) / (believed_ + others + 2.0);
  const double chance = (1.0 - kMoved) * std::pow(misread, place.opinions);
  return kMoved / (kMoved + chance);
}

// m, of how far the place is from where the landmark was: what was seen beside it shows how good
// map and belief are there; the sightings of a visit share their errors.
double LandmarkChanges::sigma_between(const Landmark& landmark, const Place& place) const {
  const auto seen = [](const Place& one) { return one.sigma / std::sqrt(std::max(1, one.visits)); };
  const double known = landmark.is_given ? 0.0 : seen(landmark.home());
  return std::hypot(place.others_off, seen(place), known);
}

// A landmark that was moved by little is believed, time and again, to be where it is not.
bool LandmarkChanges::is_off(const Landmark& landmark) const {
  const Place& home = landmark.home();
  if (!landmark.is_given || landmark.believed < kFewestSightings) return false;
  const double seen = home.sigma / std::sqrt(landmark.believed / kPerOpinion);
  const auto is_more_than = [&](double error) {
    return landmark.off.norm() > std::max(kSamePlace, kOffSigmas * std::hypot(error, seen));
  };
  const double alone = std::hypot(landmark.given_sigma, home.eye_sigma);
  return is_more_than(0.0) && (is_more_than(alone) || is_more_than(error_around(landmark)));
}

// m, by which those around it are off in each direction: an error that they share moves no landmark
// against them. Infinite if they are few.
double LandmarkChanges::error_around(const Landmark& landmark) const {
  std::vector<int> near;
  index_.near(landmark.home().position, kAround * view_.range, &near);
  double squares = 0.0;
  int others = 0;
  for (const int row : near) {
    const Landmark& other = landmarks_.at(ids_[static_cast<std::size_t>(row)]);
    if (&other == &landmark || other.believed < kFewestSightings) continue;
    squares += other.off.squaredNorm();
    ++others;
  }
  return others < kFewestAround ? std::numeric_limits<double>::infinity()
                                : std::sqrt(0.5 * squares / others);
}

// Against a landmark that is hidden as often as others are, from where it was not seen. Where none
// is overlooked in a single scan, none is hidden for a whole visit, either.
double LandmarkChanges::probability_gone(const Landmark& landmark) const {
  const double seen_before = (looks_ + 2.0) / (overlooked_ + 1.0);  // visits, as a prior
  double hidden = 1.0;
  for (std::size_t side = 0; side < sides; ++side) {
    const int missed = landmark.missed[side];
    const double of_others =
        (missed_[side] - missed + 1.0) / (visits_[side] - missed + 1.0 + seen_before);
    hidden *= std::pow(of_others, missed);
  }
  return kGone / (kGone + (1.0 - kGone) * hidden);
}

std::vector<Finding> LandmarkChanges::findings() const {
  std::vector<Finding> findings;
  std::size_t off = 0;
  for (const auto& [id, landmark] : landmarks_) off += is_off(landmark) ? 1U : 0U;
  // Where many are off it is the sensor, or the robot.
  const bool few_are_off = off <= std::max(kFewOff, landmarks_.size() / 10);
  for (const auto& [id, landmark] : landmarks_) {
    const Place* best = nullptr;
    const bool is_gone = count(landmark.missed) > 0 && probability_gone(landmark) >= kSurelyGone;
    for (std::size_t i = 1; i < landmark.places.size(); ++i) {
      const Place& place = landmark.places[i];
      const double apart = (place.position - landmark.home().position).norm();
      const double sigmas = landmark.is_given ? kSameSigmas : kApartSigmas;
      const bool is_apart = apart > std::max(kSamePlace, sigmas * sigma_between(landmark, place));
      const bool is_sure = is_apart && place.is_confirmed && probability_of(place) >= kSure;
      // What is not where it was is where it is seen, however near.
      if (is_many(place) && (is_sure || is_gone) && (best == nullptr || place.last > best->last))
        best = &place;
    }
    Finding finding;
    finding.id = id;
    if (best != nullptr) {
      const bool is_there =
          landmark.home().sightings >= kFewestSightings && count(landmark.missed) == 0;
      finding.kind = is_there ? FindingKind::landmark_twice : FindingKind::landmark_moved;
      finding.begin = best->first;
      finding.end = best->last;
      finding.place = best->position;
      finding.size = (best->position - landmark.home().position).norm();
      finding.sigma = std::hypot(landmark.home().sigma, best->sigma / std::sqrt(best->opinions));
      finding.probability =
          std::max(probability_of(*best), is_gone ? probability_gone(landmark) : 0.0);
      finding.is_open = !best->is_believed && now_ < best->last + kOpen;
    } else if (few_are_off && is_off(landmark)) {
      const Place& home = landmark.home();
      finding.kind = FindingKind::landmark_moved;
      finding.begin = home.first;
      finding.end = home.last;
      finding.place = home.position + landmark.off;
      finding.size = landmark.off.norm();
      finding.sigma =
          std::hypot(landmark.given_sigma, home.sigma / std::sqrt(landmark.believed / kPerOpinion));
      finding.probability = kSure;
      finding.is_open = now_ < home.last + kOpen;
    } else if (is_gone) {
      finding.kind = FindingKind::landmark_gone;
      finding.begin = landmark.missed_first;
      finding.end = landmark.missed_last;
      finding.place = landmark.home().position;
      finding.probability = probability_gone(landmark);
    } else {
      continue;
    }
    findings.push_back(finding);
  }
  return findings;
}

}  // namespace pf_resampling
