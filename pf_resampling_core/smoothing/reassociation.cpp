#include "pf_resampling_core/smoothing/reassociation.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

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

// A sighting's own part of the cost, were it of a landmark with this residual.
double log_normalizer(const SightingFactor& sighting, const NoiseScales& noise) {
  return kLogTwoPi + 0.5 * std::log(sighting.range_variance * sighting.bearing_variance) +
         std::log(noise.range * noise.bearing);
}

// Of landmarks, per m^2. One per m and rad, seen from a distance, is that over the distance.
double log_density_of_places(const ReassociationOptions& options, const SmoothingGraph& graph) {
  double distance = 0.0;
  for (const SightingFactor& sighting : graph.sightings) distance += sighting.range;
  distance /= static_cast<double>(graph.sightings.size());
  return options.log_density_of_landmarks - std::log(distance);
}

// A sighting that may be of a landmark.
struct Match {
  double cost;
  int sighting;
  int landmark;
};

// All sightings of all scans in order of the poses, assigned or not.
std::vector<SightingFactor> all_sightings(const SmoothingGraph& graph) {
  std::vector<SightingFactor> all = graph.sightings;
  for (SightingFactor sighting : graph.unassigned) {
    sighting.landmark = -1;
    all.push_back(sighting);
  }
  std::stable_sort(all.begin(), all.end(), [](const SightingFactor& a, const SightingFactor& b) {
    return a.pose < b.pose;
  });
  return all;
}

// Where a sighting puts its landmark, and how far off that can be, m.
struct Vicinity {
  Eigen::Vector2d centre;
  double radius;
};

Vicinity vicinity_of(const SightingFactor& sighting, const SmoothingGraph& graph) {
  constexpr double kSigmas = 10.0;
  const Pose2 eye = compose(graph.poses[static_cast<std::size_t>(sighting.pose)], sighting.sensor);
  const double direction = eye.heading + sighting.bearing;
  const double along = kSigmas * graph.noise.range * std::sqrt(sighting.range_variance) +
                       std::abs(graph.constants[SensorConstant::range_scale]) * sighting.range;
  const double across = kSigmas * graph.noise.bearing * std::sqrt(sighting.bearing_variance) +
                        std::abs(graph.constants[SensorConstant::bearing_bias]);
  return {
      {eye.x + sighting.range * std::cos(direction), eye.y + sighting.range * std::sin(direction)},
      2.0 * along + sighting.range * across};
}

// The likeliest pairs of a scan first. `is_candidate`: of landmarks; empty: all are.
void associate_scan(const ReassociationOptions& options, const SmoothingGraph& graph,
                    const std::vector<bool>& is_candidate, SightingFactor* scan, int count) {
  std::vector<Match> matches;
  for (int k = 0; k < count; ++k) {
    const Vicinity vicinity = vicinity_of(scan[k], graph);
    for (std::size_t l = 0; l < graph.landmarks.size(); ++l) {
      if (!is_candidate.empty() && !is_candidate[l]) continue;
      const double squared = (graph.landmarks[l] - vicinity.centre).squaredNorm();
      if (squared > vicinity.radius * vicinity.radius) continue;
      const double cost = sighting_cost(options, graph, scan[k], static_cast<int>(l));
      if (cost < -options.log_density_of_new) matches.push_back({cost, k, static_cast<int>(l)});
    }
    scan[k].landmark = -1;
  }
  std::sort(matches.begin(), matches.end(), [](const Match& a, const Match& b) {
    if (a.cost != b.cost) return a.cost < b.cost;
    return a.sighting != b.sighting ? a.sighting < b.sighting : a.landmark < b.landmark;
  });
  std::set<int> taken;
  for (const Match& match : matches) {
    if (scan[match.sighting].landmark >= 0 || taken.count(match.landmark) > 0) continue;
    scan[match.sighting].landmark = match.landmark;
    taken.insert(match.landmark);
  }
}

// A sighting's part of association_evidence(): what speaks against its landmark counts for less if
// others say the same.
double cost_as_it_is(const ReassociationOptions& options, const SmoothingGraph& graph,
                     const SightingFactor& sighting) {
  if (sighting.landmark < 0) return -options.log_density_of_new;
  const double normalizer = log_normalizer(sighting, graph.noise);
  const double fit = sighting_cost(options, graph, sighting, sighting.landmark) - normalizer;
  return normalizer + fit / options.redundancy;
}

// For each landmark those that a scan has seen beside it.
std::vector<std::set<int>> seen_together(const SmoothingGraph& graph) {
  std::vector<std::set<int>> together(graph.landmarks.size());
  for (std::size_t first = 0; first < graph.sightings.size();) {
    std::size_t last = first;
    while (last < graph.sightings.size() &&
           graph.sightings[last].pose == graph.sightings[first].pose) {
      ++last;
    }
    for (std::size_t i = first; i < last; ++i) {
      for (std::size_t j = first; j < last; ++j) {
        const int other = graph.sightings[j].landmark;
        if (i != j) {
          together[static_cast<std::size_t>(graph.sightings[i].landmark)].insert(other);
        }
      }
    }
    first = last;
  }
  return together;
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

// Joins a first pair, then again and again the pair that is then the most likely.
Choice joined_from(const Candidate& seed, std::vector<Candidate> candidates,
                   const std::vector<std::set<int>>& together, Places places, double log_density) {
  Duplicates found;
  std::vector<std::set<int>> apart = together;
  Candidate next = seed;
  for (;;) {
    const Odds odds = odds_of(places, next.older, next.newer, log_density);
    found.pairs.emplace_back(next.older, next.newer);
    found.log_prior_odds += odds.prior;
    found.log_odds += odds.log_odds();
    places.join(next.older, next.newer);
    // What was seen beside one of them was seen beside both.
    const std::size_t older = static_cast<std::size_t>(next.older);
    const std::size_t newer = static_cast<std::size_t>(next.newer);
    apart[older].insert(apart[newer].begin(), apart[newer].end());
    for (const int other : apart[older]) {
      apart[static_cast<std::size_t>(other)].insert(next.older);
    }
    const int gone = next.newer;
    candidates.erase(
        std::remove_if(candidates.begin(), candidates.end(),
                       [&](const Candidate& c) { return c.older == gone || c.newer == gone; }),
        candidates.end());
    next.log_odds = 0.0;
    bool is_any = false;
    for (const Candidate& c : candidates) {
      if (apart[static_cast<std::size_t>(c.older)].count(c.newer) > 0) continue;
      const Odds of_pair = odds_of(places, c.older, c.newer, log_density);
      if (of_pair.squared > kFarthest || of_pair.log_odds() <= next.log_odds) continue;
      next = {c.older, c.newer, of_pair.log_odds()};
      is_any = true;
    }
    if (!is_any) return {std::move(found), std::move(places)};
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

// What the prior says of the second of a pair, it says of the first.
void join_in_prior(int older, int newer, GaussianPrior* prior) {
  if (newer >= static_cast<int>(prior->landmarks.size())) return;
  const std::size_t first = static_cast<std::size_t>(older);
  const std::size_t second = static_cast<std::size_t>(newer);
  const Eigen::Index to = 3 + 2 * older;
  const Eigen::Index from = 3 + 2 * newer;
  prior->gradient +=
      prior->information.middleCols<2>(from) * (prior->landmarks[first] - prior->landmarks[second]);
  prior->gradient.segment<2>(to) += prior->gradient.segment<2>(from);
  prior->gradient.segment<2>(from).setZero();
  prior->information.middleCols<2>(to) += prior->information.middleCols<2>(from).eval();
  prior->information.middleCols<2>(from).setZero();
  prior->information.middleRows<2>(to) += prior->information.middleRows<2>(from).eval();
  prior->information.middleRows<2>(from).setZero();
  prior->landmarks_given_path[first] += prior->landmarks_given_path[second];
}

}  // namespace

double association_cost(const ReassociationOptions& options, double cost,
                        const SmoothingGraph& graph) {
  for (const SightingFactor& sighting : graph.sightings) {
    cost += log_normalizer(sighting, graph.noise);
  }
  return cost - options.log_density_of_new * static_cast<double>(graph.unassigned.size());
}

double association_evidence(const ReassociationOptions& options, const SmoothingResult& solution,
                            const SmoothingGraph& graph) {
  double evidence =
      association_cost(options, solution.cost, graph) + 0.5 * solution.log_determinant;
  if (graph.sightings.empty()) return evidence;
  for (const SightingFactor& sighting : graph.sightings) {
    evidence += cost_as_it_is(options, graph, sighting) -
                sighting_cost(options, graph, sighting, sighting.landmark);
  }
  // A landmark may be anywhere: two unknowns, with the density of landmarks for a prior.
  return evidence - static_cast<double>(graph.landmarks.size()) *
                        (kLogTwoPi + log_density_of_places(options, graph));
}

double sighting_cost(const ReassociationOptions& options, const SmoothingGraph& graph,
                     const SightingFactor& sighting, int landmark) {
  const SightingResidual r =
      sighting_residual(sighting, graph.noise, graph.poses[static_cast<std::size_t>(sighting.pose)],
                        graph.landmarks[static_cast<std::size_t>(landmark)], graph.constants);
  return log_normalizer(sighting, graph.noise) +
         robust_cost(r.value.squaredNorm(), options.robust_width);
}

double redundancy_of(const SmoothingGraph& graph, const std::vector<double>& times, double gap) {
  std::vector<double> last(graph.landmarks.size(), -std::numeric_limits<double>::infinity());
  int passages = 0;
  for (const SightingFactor& sighting : graph.sightings) {
    const double now = times[static_cast<std::size_t>(sighting.pose)];
    double& before = last[static_cast<std::size_t>(sighting.landmark)];
    if (now - before > gap) ++passages;
    before = now;
  }
  return passages > 0 ? static_cast<double>(graph.sightings.size()) / passages : 1.0;
}

int reassociate(const ReassociationOptions& options, SmoothingGraph* graph) {
  std::vector<SightingFactor> all = all_sightings(*graph);
  int changed = 0;
  std::vector<int> before;
  for (std::size_t first = 0; first < all.size();) {
    std::size_t last = first;
    before.clear();
    while (last < all.size() && all[last].pose == all[first].pose) {
      before.push_back(all[last++].landmark);
    }
    associate_scan(options, *graph, {}, &all[first], static_cast<int>(last - first));
    for (std::size_t k = first; k < last; ++k) changed += all[k].landmark != before[k - first];
    first = last;
  }
  graph->sightings.clear();
  graph->unassigned.clear();
  for (const SightingFactor& sighting : all) {
    (sighting.landmark >= 0 ? graph->sightings : graph->unassigned).push_back(sighting);
  }
  return changed;
}

bool track_anew(const ReassociationOptions& options, int from, int to, double gap,
                const std::vector<double>& times, SmoothingGraph* graph) {
  for (std::size_t i = static_cast<std::size_t>(from); i + 1 < static_cast<std::size_t>(to); ++i) {
    graph->poses[i + 1] =
        compose(graph->poses[i], corrected_motion(graph->motions[i], graph->constants));
  }
  std::vector<SightingFactor> all = all_sightings(*graph);
  graph->sightings.clear();
  graph->unassigned.clear();
  const auto keep = [&](const SightingFactor& sighting) {
    (sighting.landmark >= 0 ? graph->sightings : graph->unassigned).push_back(sighting);
  };
  std::size_t first = 0;
  for (; first < all.size() && all[first].pose < from; ++first) keep(all[first]);
  std::vector<double> last_seen(graph->landmarks.size(), -std::numeric_limits<double>::infinity());
  std::vector<int> sightings(graph->landmarks.size(), 0);
  while (first < all.size() && all[first].pose < to) {
    std::size_t last = first;
    while (last < all.size() && all[last].pose == all[first].pose) ++last;
    const double now = times[static_cast<std::size_t>(all[first].pose)];
    std::vector<bool> is_candidate;
    for (const double seen : last_seen) is_candidate.push_back(now - seen <= gap);
    associate_scan(options, *graph, is_candidate, &all[first], static_cast<int>(last - first));
    for (; first < last; ++first) {
      SightingFactor& sighting = all[first];
      const Eigen::Vector2d place = vicinity_of(sighting, *graph).centre;
      if (sighting.landmark < 0) {
        if (graph->landmarks.size() >= options.most_landmarks) return false;
        sighting.landmark = static_cast<int>(graph->landmarks.size());
        graph->landmarks.push_back(place);
        last_seen.push_back(now);
        sightings.push_back(0);
      }
      const std::size_t landmark = static_cast<std::size_t>(sighting.landmark);
      // The mean of some: what drifts with the odometry is followed.
      sightings[landmark] = std::min(sightings[landmark] + 1, kMostAveraged);
      graph->landmarks[landmark] += (place - graph->landmarks[landmark]) / sightings[landmark];
      last_seen[landmark] = now;
      graph->sightings.push_back(sighting);
    }
  }
  for (; first < all.size(); ++first) keep(all[first]);
  return true;
}

std::vector<Dispensable> find_dispensable(const ReassociationOptions& options,
                                          const SmoothingGraph& graph, double most) {
  const std::size_t count = graph.landmarks.size();
  std::vector<double> costs(count, 0.0);
  std::vector<std::map<int, int>> votes(count);
  std::vector<bool> is_seen(count, false);
  std::vector<bool> is_candidate(count, true);
  const std::vector<SightingFactor> all = all_sightings(graph);
  std::vector<SightingFactor> scan;
  for (std::size_t first = 0; first < all.size();) {
    std::size_t last = first;
    while (last < all.size() && all[last].pose == all[first].pose) ++last;
    double before = 0.0;
    for (std::size_t k = first; k < last; ++k) before += cost_as_it_is(options, graph, all[k]);
    for (std::size_t k = first; k < last; ++k) {
      if (all[k].landmark < 0) continue;
      const std::size_t landmark = static_cast<std::size_t>(all[k].landmark);
      is_seen[landmark] = true;
      if (costs[landmark] > most) continue;
      scan.assign(all.begin() + static_cast<std::ptrdiff_t>(first),
                  all.begin() + static_cast<std::ptrdiff_t>(last));
      is_candidate[landmark] = false;
      associate_scan(options, graph, is_candidate, scan.data(), static_cast<int>(scan.size()));
      is_candidate[landmark] = true;
      costs[landmark] -= before;
      for (const SightingFactor& sighting : scan) {
        costs[landmark] += cost_as_it_is(options, graph, sighting);
      }
      ++votes[landmark][scan[k - first].landmark];
    }
    first = last;
  }
  const std::vector<std::set<int>> together = seen_together(graph);
  std::vector<Dispensable> found;
  for (std::size_t l = 0; l < count; ++l) {
    if (!is_seen[l] || costs[l] > most) continue;
    const auto other =
        std::max_element(votes[l].begin(), votes[l].end(),
                         [](const auto& a, const auto& b) { return a.second < b.second; });
    if (together[l].count(other->first) == 0) continue;
    found.push_back({static_cast<int>(l), other->first, costs[l]});
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Dispensable& a, const Dispensable& b) { return a.cost < b.cost; });
  return found;
}

Duplicates find_duplicates(const ReassociationOptions& options, const SmoothingGraph& graph,
                           const JointBelief& belief) {
  const int count = static_cast<int>(graph.landmarks.size());
  if (count < 2 || graph.sightings.empty()) return {};
  double variance = 0.0;
  for (const SightingFactor& sighting : graph.sightings) {
    variance +=
        sighting.range_variance + sighting.range * sighting.range * sighting.bearing_variance;
  }
  variance /= 2.0 * static_cast<double>(graph.sightings.size());
  const double log_density = log_density_of_places(options, graph);

  Places places;
  places.covariance = belief.covariance.topLeftCorner(2 * count, 2 * count);
  places.mean.resize(2 * count);
  for (int l = 0; l < count; ++l) {
    places.mean.segment<2>(2 * l) = graph.landmarks[static_cast<std::size_t>(l)];
  }
  const std::vector<std::set<int>> together = seen_together(graph);
  std::vector<Candidate> candidates;
  for (int newer = 1; newer < count; ++newer) {
    for (int older = 0; older < newer; ++older) {
      if (together[static_cast<std::size_t>(older)].count(newer) > 0) continue;
      const Odds odds = odds_of(places, older, newer, log_density);
      if (odds.squared < kFarthest) candidates.push_back({older, newer, odds.log_odds()});
    }
  }
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    if (a.log_odds != b.log_odds) return a.log_odds > b.log_odds;
    return a.newer != b.newer ? a.newer < b.newer : a.older < b.older;
  });
  // The belief is kept for the best of them alone: it is large.
  Choice best;
  std::vector<Duplicates> others;
  for (std::size_t seed = 0; seed < std::min(kMostSeeds, candidates.size()); ++seed) {
    Choice choice = joined_from(candidates[seed], candidates, together, places, log_density);
    others.push_back(choice.found);
    if (seed == 0 || choice.found.log_odds > best.found.log_odds) best = std::move(choice);
  }
  if (others.empty() || best.found.log_odds < kSureLogOdds) return {};
  for (const Duplicates& other : others) {
    if (other.log_odds > best.found.log_odds - kSureLogOdds &&
        contradict(best.places, other, variance)) {
      return {};
    }
  }
  return best.found;
}

void merge_landmarks(const std::vector<std::pair<int, int>>& pairs, SmoothingGraph* graph) {
  for (const auto& [older, newer] : pairs) {
    join_in_prior(older, newer, &graph->prior);
    for (SightingFactor& sighting : graph->sightings) {
      if (sighting.landmark == newer) sighting.landmark = older;
    }
  }
}

}  // namespace pf_resampling
