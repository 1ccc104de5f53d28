#include "pf_resampling_core/filters/fastslam/memory/reassociation.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "pf_resampling_core/filters/fastslam/memory/landmark_index.hpp"
#include "pf_resampling_core/smoothing/residuals.hpp"

namespace pf_resampling {
namespace {

constexpr double kLogTwoPi = 1.8378770664093453;
// Squared distance, in standard deviations, beyond which two landmarks are never one (99.9 %).
constexpr double kFarthest = 13.8;
// First pairs that are tried.
constexpr std::size_t kMostSeeds = 20;
// Sightings whose mean is where a landmark is while it is tracked.
constexpr int kMostAveraged = 5;
// Landmarks in question, and others beside them: their joint belief is dense.
constexpr std::size_t kMostCompared = 60;

// A sighting's own part of the cost, were it of a landmark with this residual.
double log_normalizer(const SightingFactor& sighting, const NoiseScales& noise) {
  return kLogTwoPi + 0.5 * std::log(sighting.range_variance * sighting.bearing_variance) +
         std::log(noise.range * noise.bearing);
}

// Of landmarks, per m^2. One per m and rad, seen from a distance, is that over the distance.
double log_density_of_places(const ReassociationOptions& options,
                             const SightingStatistics& statistics) {
  return options.log_density_of_landmarks - std::log(statistics.range);
}

template <typename Item>
bool has(const std::vector<Item>& items, const Item& item) {
  return std::find(items.begin(), items.end(), item) != items.end();
}

// Where a sighting puts its landmark, and how far off that can be, m, before it is rather of none.
struct Vicinity {
  Eigen::Vector2d centre;
  double radius;
};

Vicinity vicinity_of(const ReassociationOptions& options, const SightingFactor& sighting,
                     const Pose2& pose, const SegmentGraph& graph) {
  constexpr double kMargin = 1.1;  // the arc is not straight
  const Pose2 eye = compose(pose, sighting.sensor);
  const double scale = 1.0 + graph.constants[SensorConstant::range_scale];
  const double range = sighting.range / scale;
  const double bearing = sighting.bearing - graph.constants[SensorConstant::bearing_bias];
  const double along = graph.noise.range * std::sqrt(sighting.range_variance) / scale;
  const double across = range * graph.noise.bearing * std::sqrt(sighting.bearing_variance);
  // Of the squared residual, where robust_cost() is as much as it costs to be of none.
  const double spare = -options.log_density_of_new - log_normalizer(sighting, graph.noise);
  const double width = options.robust_width * options.robust_width;
  const double squared =
      width > 0.0 ? width * std::expm1(2.0 * std::max(0.0, spare) / width) : 2.0 * spare;
  const double sigmas = std::sqrt(std::max(0.0, squared));
  return {place_seen(eye, range, bearing), kMargin * sigmas * std::max(along, across)};
}

LandmarkIndex index_of(const SegmentGraph& graph) {
  LandmarkIndex index;
  const std::vector<bool> are_seen = seen_landmarks(graph);
  for (std::size_t l = 0; l < are_seen.size(); ++l) {
    if (are_seen[l]) index.place(static_cast<int>(l), graph.landmarks[l]);
  }
  return index;
}

std::vector<int> near(const LandmarkIndex& index, const Vicinity& vicinity) {
  std::vector<int> found;
  index.near(vicinity.centre, vicinity.radius, &found);
  return found;
}

// Of the sightings of one scan, the likeliest pairs first. `candidates`: landmarks near a sighting,
// of which one may be left out.
template <typename Candidates>
void associate_scan(const ReassociationOptions& options, const SegmentGraph& graph,
                    const Pose2& pose, const Candidates& candidates, SightingFactor* scan,
                    int count, int left_out = -1) {
  std::vector<std::tuple<double, int, int>> matches;  // cost, sighting, landmark
  for (int k = 0; k < count; ++k) {
    for (const int landmark : candidates(scan[k])) {
      const double cost = sighting_cost(options, graph, pose, scan[k], landmark);
      if (cost < -options.log_density_of_new) matches.emplace_back(cost, k, landmark);
    }
    scan[k].landmark = -1;
  }
  std::sort(matches.begin(), matches.end());
  std::vector<int> taken = {left_out};
  for (const auto& [cost, sighting, landmark] : matches) {
    if (scan[sighting].landmark >= 0 || has(taken, landmark)) continue;
    scan[sighting].landmark = landmark;
    taken.push_back(landmark);
  }
}

// Calls `visit(first, last)` for the sightings of each scan.
template <typename Visit>
void for_each_scan(const std::vector<SightingFactor>& sightings, const Visit& visit) {
  for (std::size_t first = 0; first < sightings.size();) {
    std::size_t last = first;
    while (last < sightings.size() && sightings[last].pose == sightings[first].pose) ++last;
    visit(first, last);
    first = last;
  }
}

// A sighting's part of association_evidence(): what speaks against its landmark counts for less if
// others say the same.
double cost_as_it_is(const ReassociationOptions& options, double redundancy,
                     const SegmentGraph& graph, const Pose2& pose, const SightingFactor& sighting) {
  if (sighting.landmark < 0) return -options.log_density_of_new;
  const double normalizer = log_normalizer(sighting, graph.noise);
  const double fit = sighting_cost(options, graph, pose, sighting, sighting.landmark) - normalizer;
  return normalizer + fit / redundancy;
}

// The belief about the landmarks' places as pairs of them become one.
struct Places {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;

  Eigen::Vector2d difference(int i, int j) const {
    return mean.segment<2>(2 * i) - mean.segment<2>(2 * j);
  }
  Eigen::Matrix2d uncertainty(int i, int j) const {
    const auto block = [&](int a, int b) { return covariance.block<2, 2>(2 * a, 2 * b); };
    return block(i, i) + block(j, j) - block(i, j) - block(j, i);
  }
  void join(int i, int j) {
    const Eigen::MatrixXd across =
        covariance.middleCols<2>(2 * i) - covariance.middleCols<2>(2 * j);
    const Eigen::MatrixXd gain = across * uncertainty(i, j).inverse();
    mean -= gain * difference(i, j);
    covariance -= gain * across.transpose();
  }
};

// What two landmarks being one is worth.
struct Odds {
  double prior = 0.0;    // logarithm, without the fit
  double squared = 0.0;  // the fit: squared distance
  double log_odds() const { return prior - 0.5 * squared; }
};

Odds odds_of(const Places& places, int i, int j, double log_density) {
  const Eigen::Matrix2d uncertainty = places.uncertainty(i, j);
  const double determinant = uncertainty.determinant();
  if (!(determinant > 0.0)) return {0.0, 2.0 * kFarthest};
  const Eigen::Vector2d difference = places.difference(i, j);
  return {-kLogTwoPi - 0.5 * std::log(determinant) - log_density,
          difference.dot(uncertainty.inverse() * difference)};
}

struct Candidate {
  int older, newer;
  double log_odds;
};

// Pairs, and the belief once they are one.
struct Choice {
  Duplicates found;
  Places places;
};

// Joins a first pair, then again and again the pair that is then the most likely. What comes last
// and is not sure by itself does not count: that other pairs are one says nothing for it.
Choice joined_from(const Candidate& seed, const std::vector<Candidate>& candidates, Together apart,
                   Places places, double log_density) {
  Choice sure;
  Duplicates found;
  Candidate next = seed;
  for (;;) {
    const Odds odds = odds_of(places, next.older, next.newer, log_density);
    found.pairs.emplace_back(next.older, next.newer);
    found.log_prior_odds += odds.prior;
    found.log_odds += odds.log_odds();
    places.join(next.older, next.newer);
    // What was seen beside one of them was seen beside both.
    for (Eigen::Index other = 0; other < apart.rows(); ++other) {
      if (apart(next.newer, other)) apart(next.older, other) = apart(other, next.older) = true;
    }
    apart.row(next.newer).setConstant(true);
    apart.col(next.newer).setConstant(true);
    next.log_odds = 0.0;
    for (const Candidate& c : candidates) {
      if (apart(c.older, c.newer)) continue;
      const Odds of_pair = odds_of(places, c.older, c.newer, log_density);
      if (of_pair.squared > kFarthest || of_pair.log_odds() <= next.log_odds) continue;
      next = {c.older, c.newer, of_pair.log_odds()};
    }
    const bool is_sure = found.log_odds - sure.found.log_odds >= kSureLogOdds;
    if (is_sure && next.log_odds < kSureLogOdds) sure = {found, places};
    if (next.log_odds == 0.0) return sure;
  }
}

// Whether they put the robot at different places: what the one joins is far apart once the other is
// right. Neighbours taken for each other do not.
bool contradict(const Places& best, const Duplicates& other, double sighting_variance) {
  const Eigen::Matrix2d neighbourhood = sighting_variance * Eigen::Matrix2d::Identity();
  return std::any_of(other.pairs.begin(), other.pairs.end(), [&](const auto& pair) {
    const Eigen::Matrix2d uncertainty = best.uncertainty(pair.first, pair.second) + neighbourhood;
    const Eigen::Vector2d difference = best.difference(pair.first, pair.second);
    return difference.dot(uncertainty.inverse() * difference) > kFarthest;
  });
}

// Those in question, and those that they may be, which no scan has seen beside them: of both the
// nearest. In ascending order.
std::vector<int> compared_landmarks(const SegmentGraph& graph,
                                    const std::vector<int>& in_question) {
  const std::vector<bool> are_seen = seen_landmarks(graph);
  std::vector<int> seen;
  for (std::size_t l = 0; l < are_seen.size(); ++l) {
    if (are_seen[l]) seen.push_back(static_cast<int>(l));
  }
  const Together together = seen_together(graph, seen);
  std::vector<bool> is_asked;
  for (const int landmark : seen) is_asked.push_back(has(in_question, landmark));
  std::vector<std::pair<double, int>> asked, others;  // by the squared distance
  for (std::size_t i = 0; i < seen.size(); ++i) {
    double nearest = std::numeric_limits<double>::infinity();
    const Eigen::Vector2d& place = graph.landmarks[static_cast<std::size_t>(seen[i])];
    for (std::size_t k = 0; k < seen.size(); ++k) {
      const bool may_be_one = i != k && (is_asked[i] || is_asked[k]) &&
                              !together(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
      if (!may_be_one) continue;
      const Eigen::Vector2d& other = graph.landmarks[static_cast<std::size_t>(seen[k])];
      nearest = std::min(nearest, (place - other).squaredNorm());
    }
    if (std::isfinite(nearest)) (is_asked[i] ? asked : others).emplace_back(nearest, seen[i]);
  }
  std::vector<int> compared;
  for (auto* kind : {&asked, &others}) {
    std::sort(kind->begin(), kind->end());
    kind->resize(std::min(kind->size(), kMostCompared));
    for (const auto& [distance, landmark] : *kind) compared.push_back(landmark);
  }
  std::sort(compared.begin(), compared.end());
  return compared;
}

}  // namespace

SightingStatistics statistics_of(const SegmentGraph& graph, const std::vector<double>& begins) {
  SightingStatistics statistics;
  std::vector<double> last(graph.landmarks.size(), -std::numeric_limits<double>::infinity());
  int passages = 0;
  double count = 0.0;
  double range = 0.0;
  double variance = 0.0;
  for_each_sighting(
      graph, begins, [&](int, double now, const SightingFactor& sighting, int landmark) {
        double& before = last[static_cast<std::size_t>(landmark)];
        if (now - before > kPassageGap) ++passages;
        before = now;
        ++count;
        range += sighting.range;
        variance += 0.5 * (sighting.range_variance +
                           sighting.range * sighting.range * sighting.bearing_variance);
      });
  if (passages > 0) statistics = {range / count, variance / count, count / passages};
  return statistics;
}

double sighting_cost(const ReassociationOptions& options, const SegmentGraph& graph,
                     const Pose2& pose, const SightingFactor& sighting, int landmark) {
  const SightingResidual r =
      sighting_residual(sighting, graph.noise, pose,
                        graph.landmarks[static_cast<std::size_t>(landmark)], graph.constants);
  return log_normalizer(sighting, graph.noise) +
         robust_cost(r.value.squaredNorm(), options.robust_width);
}

double association_cost(const ReassociationOptions& options, double cost,
                        const SegmentGraph& graph) {
  const double of_each = kLogTwoPi + std::log(graph.noise.range * graph.noise.bearing);
  for (const auto& segment : graph.segments) {
    cost += segment->log_noise + static_cast<double>(segment->sightings.size()) * of_each;
    cost -= options.log_density_of_new * static_cast<double>(segment->unassigned.size());
  }
  return cost;
}

double association_evidence(const ReassociationOptions& options,
                            const SightingStatistics& statistics, double cost,
                            double log_determinant, const SegmentGraph& graph) {
  double fit = 0.0;
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    const Segment& segment = *graph.segments[s];
    const CondensedSegment& condensed = *segment.condensed;
    const auto weights = weights_of(graph, s, segment);
    const Eigen::VectorXd e = difference(graph, s, segment);
    for (const int kind : {DataKind::range, DataKind::bearing}) {
      const std::size_t k = static_cast<std::size_t>(kind);
      if (condensed.information[k].size() == 0) continue;
      fit += weights[k] * (condensed.cost[k] + e.dot(condensed.gradient[k]) +
                           0.5 * e.dot(condensed.information[k] * e));
    }
  }
  const std::vector<bool> are_seen = seen_landmarks(graph);
  const auto landmarks = std::count(are_seen.begin(), are_seen.end(), true);
  // A landmark may be anywhere: two unknowns, with the density of landmarks for a prior.
  return association_cost(options, cost, graph) + fit * (1.0 / statistics.redundancy - 1.0) +
         0.5 * log_determinant -
         static_cast<double>(landmarks) * (kLogTwoPi + log_density_of_places(options, statistics));
}

int reassociate(const ReassociationOptions& options, const SegmentGraph& graph, Scans* scans) {
  const LandmarkIndex index = index_of(graph);
  for_each_scan(scans->sightings, [&](std::size_t first, std::size_t last) {
    SightingFactor* scan = &scans->sightings[first];
    const Pose2& pose = scans->poses[static_cast<std::size_t>(scan->pose)];
    const auto candidates = [&](const SightingFactor& sighting) {
      return near(index, vicinity_of(options, sighting, pose, graph));
    };
    associate_scan(options, graph, pose, candidates, scan, static_cast<int>(last - first));
  });
  int changed = 0;
  for (std::size_t i = 0; i < scans->sightings.size(); ++i) {
    changed += scans->sightings[i].landmark != scans->before[i];
  }
  return changed;
}

double ambiguous_share(const ReassociationOptions& options, const SegmentGraph& graph,
                       const Scans& scans) {
  const LandmarkIndex index = index_of(graph);
  int all = 0, ambiguous = 0;
  for (const SightingFactor& sighting : scans.sightings) {
    if (sighting.landmark < 0) continue;
    const Pose2& pose = scans.poses[static_cast<std::size_t>(sighting.pose)];
    const auto cost = [&](int landmark) {
      return sighting_cost(options, graph, pose, sighting, landmark);
    };
    const double limit = cost(sighting.landmark) + kSureLogOdds;
    const std::vector<int> candidates = near(index, vicinity_of(options, sighting, pose, graph));
    ++all;
    ambiguous += std::any_of(candidates.begin(), candidates.end(), [&](int other) {
      return other != sighting.landmark && cost(other) < limit;
    });
  }
  return all > 0 ? static_cast<double>(ambiguous) / all : 0.0;
}

bool track_anew(const ReassociationOptions& options, int first, Scans* scans, SegmentGraph* graph) {
  std::vector<Pose2>& poses = scans->poses;
  for (std::size_t i = static_cast<std::size_t>(first) + 1; i < poses.size(); ++i) {
    poses[i] = compose(poses[i - 1], corrected_motion(scans->motions[i], graph->constants));
  }
  struct Track {
    int landmark;
    int sightings;
    double last_seen;
  };
  std::vector<Track> tracks;
  bool has_room = true;
  for_each_scan(scans->sightings, [&](std::size_t begin, std::size_t end) {
    SightingFactor* scan = &scans->sightings[begin];
    if (scan->pose < first || !has_room) return;
    const Pose2& pose = poses[static_cast<std::size_t>(scan->pose)];
    const double now = scans->times[static_cast<std::size_t>(scan->pose)];
    const auto candidates = [&](const SightingFactor& sighting) {
      const Vicinity vicinity = vicinity_of(options, sighting, pose, *graph);
      std::vector<int> near;
      for (const Track& track : tracks) {
        const Eigen::Vector2d& place = graph->landmarks[static_cast<std::size_t>(track.landmark)];
        const double squared = (place - vicinity.centre).squaredNorm();
        if (now - track.last_seen <= kPassageGap && squared <= vicinity.radius * vicinity.radius) {
          near.push_back(track.landmark);
        }
      }
      return near;
    };
    associate_scan(options, *graph, pose, candidates, scan, static_cast<int>(end - begin));
    for (std::size_t k = begin; k < end && has_room; ++k) {
      SightingFactor& sighting = scans->sightings[k];
      const Eigen::Vector2d place = vicinity_of(options, sighting, pose, *graph).centre;
      if (sighting.landmark < 0) {
        has_room = graph->landmarks.size() < options.most_landmarks;
        sighting.landmark = static_cast<int>(graph->landmarks.size());
        graph->landmarks.push_back(place);
        tracks.push_back({sighting.landmark, 0, now});
      }
      const auto track = std::find_if(tracks.begin(), tracks.end(), [&](const Track& t) {
        return t.landmark == sighting.landmark;
      });
      // The mean of some: what drifts with the odometry is followed.
      track->sightings = std::min(track->sightings + 1, kMostAveraged);
      Eigen::Vector2d& mean = graph->landmarks[static_cast<std::size_t>(sighting.landmark)];
      mean += (place - mean) / track->sightings;
      track->last_seen = now;
    }
  });
  return has_room;
}

std::vector<Dispensable> find_dispensable(const ReassociationOptions& options, double redundancy,
                                          const SegmentGraph& graph, const Scans& scans,
                                          double most) {
  const std::size_t count = graph.landmarks.size();
  const LandmarkIndex index = index_of(graph);
  std::vector<double> costs(count, 0.0);
  std::vector<std::map<int, int>> votes(count);
  std::vector<SightingFactor> scan;
  for_each_scan(scans.sightings, [&](std::size_t first, std::size_t last) {
    const Pose2& pose = scans.poses[static_cast<std::size_t>(scans.sightings[first].pose)];
    const auto candidates = [&](const SightingFactor& sighting) {
      return near(index, vicinity_of(options, sighting, pose, graph));
    };
    double before = 0.0;
    for (std::size_t k = first; k < last; ++k) {
      before += cost_as_it_is(options, redundancy, graph, pose, scans.sightings[k]);
    }
    for (std::size_t k = first; k < last; ++k) {
      const int landmark = scans.sightings[k].landmark;
      if (landmark < 0 || costs[static_cast<std::size_t>(landmark)] > most) continue;
      scan.assign(scans.sightings.begin() + static_cast<std::ptrdiff_t>(first),
                  scans.sightings.begin() + static_cast<std::ptrdiff_t>(last));
      associate_scan(options, graph, pose, candidates, scan.data(), static_cast<int>(scan.size()),
                     landmark);
      double& cost = costs[static_cast<std::size_t>(landmark)];
      cost -= before;
      for (const SightingFactor& sighting : scan) {
        cost += cost_as_it_is(options, redundancy, graph, pose, sighting);
      }
      ++votes[static_cast<std::size_t>(landmark)][scan[k - first].landmark];
    }
  });
  std::vector<Dispensable> found;
  for (std::size_t l = 0; l < count; ++l) {
    if (votes[l].empty() || costs[l] > most) continue;
    const auto other =
        std::max_element(votes[l].begin(), votes[l].end(),
                         [](const auto& a, const auto& b) { return a.second < b.second; });
    const int landmark = static_cast<int>(l);
    if (other->first < 0 || !seen_together(graph, {landmark, other->first})(0, 1)) continue;
    found.push_back({landmark, other->first, costs[l]});
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Dispensable& a, const Dispensable& b) { return a.cost < b.cost; });
  return found;
}

Duplicates find_duplicates(const ReassociationOptions& options,
                           const SightingStatistics& statistics, const SegmentGraph& graph,
                           const SegmentEquations& equations, const std::vector<int>& in_question) {
  const std::vector<int> compared = compared_landmarks(graph, in_question);
  if (compared.size() < 2 || in_question.empty()) return {};
  const double log_density = log_density_of_places(options, statistics);
  const int count = static_cast<int>(compared.size());
  std::vector<bool> is_in_question;
  Places places;
  places.covariance = equations.covariance_of(compared);
  places.mean.resize(2 * count);
  for (int i = 0; i < count; ++i) {
    const int landmark = compared[static_cast<std::size_t>(i)];
    places.mean.segment<2>(2 * i) = graph.landmarks[static_cast<std::size_t>(landmark)];
    is_in_question.push_back(has(in_question, landmark));
  }
  const Together together = seen_together(graph, compared);
  std::vector<Candidate> candidates;
  for (int newer = 1; newer < count; ++newer) {
    for (int older = 0; older < newer; ++older) {
      const bool is_asked = is_in_question[static_cast<std::size_t>(older)] ||
                            is_in_question[static_cast<std::size_t>(newer)];
      if (!is_asked || together(older, newer)) continue;
      const Odds odds = odds_of(places, older, newer, log_density);
      if (odds.squared < kFarthest) candidates.push_back({older, newer, odds.log_odds()});
    }
  }
  const auto is_near = [&](const Candidate& c) {
    return places.difference(c.older, c.newer).squaredNorm() <
           2.0 * kFarthest * statistics.variance;
  };
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return std::tie(b.log_odds, a.newer, a.older) < std::tie(a.log_odds, b.newer, b.older);
  });
  // The belief is kept for the best of them alone: it is large.
  Choice best;
  std::vector<Duplicates> others;
  for (std::size_t seed = 0; seed < std::min(kMostSeeds, candidates.size()); ++seed) {
    // What an earlier choice has joined, too, would lead to the same.
    const std::pair<int, int> first(candidates[seed].older, candidates[seed].newer);
    if (std::any_of(others.begin(), others.end(),
                    [&](const Duplicates& other) { return has(other.pairs, first); })) {
      continue;
    }
    Choice choice = joined_from(candidates[seed], candidates, together, places, log_density);
    others.push_back(choice.found);
    // The surest pairs come first: another has to be worth joining besides them.
    if (choice.found.log_odds > best.found.log_odds + kSureLogOdds) best = std::move(choice);
  }
  if (best.found.pairs.empty()) return {};
  for (const Duplicates& other : others) {
    if (other.log_odds > best.found.log_odds - kSureLogOdds &&
        contradict(best.places, other, statistics.variance)) {
      return {};
    }
  }
  for (const Candidate& c : candidates) {
    if (!has(best.found.pairs, std::make_pair(c.older, c.newer)) || !is_near(c)) continue;
    best.found.log_odds_of_near += std::max(0.0, c.log_odds);
  }
  for (auto& [older, newer] : best.found.pairs) {
    older = compared[static_cast<std::size_t>(older)];
    newer = compared[static_cast<std::size_t>(newer)];
  }
  return best.found;
}

}  // namespace pf_resampling
