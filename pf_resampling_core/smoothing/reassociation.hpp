#pragma once

#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "pf_resampling_core/smoothing/smoother.hpp"
#include "pf_resampling_core/smoothing/smoothing_graph.hpp"

namespace pf_resampling {

/// What decides which landmark a sighting is of, where the landmarks have no ids.
struct ReassociationOptions {
  double robust_width = 0.0;  ///< as in SmoothingOptions
  /// Logarithm of the density, per m and rad, of sightings that are of no landmark known: of new
  /// ones, or of none.
  double log_density_of_new = 0.0;
  /// Likewise, of the landmarks that there are.
  double log_density_of_landmarks = 0.0;
  /// The joint belief about them is dense.
  std::size_t most_landmarks = std::numeric_limits<std::size_t>::max();
  /// So many sightings say as much as one of whether there is one landmark or two: errors of real
  /// sensors last, and all sightings of a passage may have the same. 1 if none lasts; see
  /// redundancy_of(). It counts in association_evidence() and find_dispensable() alone: of how well
  /// data fit, as a power of their likelihood.
  double redundancy = 1.0;
};

/// Sightings per passage of a landmark, on average; 1 if there are none. A passage ends when its
/// landmark was not seen for `gap` (s). `times`: of the poses, s.
double redundancy_of(const SmoothingGraph& graph, const std::vector<double>& times, double gap);

/// Minus the logarithm of the posterior of estimate and associations, but for a constant: the
/// graph's cost and what its associations add to it. `cost`: as smooth() found it.
double association_cost(const ReassociationOptions& options, double cost,
                        const SmoothingGraph& graph);

/// Minus the logarithm of the evidence for the associations, but for a constant: of how probable
/// they make the data, whatever the estimate (Laplace's approximation). Graphs of the same poses
/// can be compared by it, however many landmarks each takes there to be; see redundancy, too.
double association_evidence(const ReassociationOptions& options, const SmoothingResult& solution,
                            const SmoothingGraph& graph);

/// What a sighting adds to that if it is of this landmark.
double sighting_cost(const ReassociationOptions& options, const SmoothingGraph& graph,
                     const SightingFactor& sighting, int landmark);

/// Decides anew, at the graph's estimate, which landmark each sighting is of, or whether it is of
/// none: in every scan the likeliest pairs first, no landmark twice (as Data association by mutual
/// exclusion, Montemerlo 2003, but with all that is known by now). Returns how many changed.
int reassociate(const ReassociationOptions& options, SmoothingGraph* graph);

/// Takes what was seen from pose `from` on, up to before pose `to`, for sightings of landmarks that
/// were never seen before: these poses by odometry, each scan's sightings of those seen within
/// `gap` (s) that fit best, or of another. `times`: of the poses, s. False, with the graph half
/// done, if there are too many.
bool track_anew(const ReassociationOptions& options, int from, int to, double gap,
                const std::vector<double>& times, SmoothingGraph* graph);

/// Logarithm of the odds from which on landmarks are taken for one: 20 to 1.
inline constexpr double kSureLogOdds = 3.0;

/// A landmark that the map could do without.
struct Dispensable {
  int landmark = 0;
  int other = 0;      ///< most of its sightings would be of this one
  double cost = 0.0;  ///< what association_cost() would grow by, at the estimate as it is
};

/// The landmarks for which that is least if their scans are shared among the others; the least
/// first, none above `most`. Only those that a scan has seen beside the other, perhaps by mistake:
/// find_duplicates() decides about those that none has.
std::vector<Dispensable> find_dispensable(const ReassociationOptions& options,
                                          const SmoothingGraph& graph, double most);

/// Landmarks that are one: pairs of their numbers, the older first.
struct Duplicates {
  std::vector<std::pair<int, int>> pairs;
  /// Logarithm of how much more likely it is that the pairs are one than that they are not, but
  /// for how well the data then fit: -cost.
  double log_prior_odds = 0.0;
  /// With the cost that the belief predicts.
  double log_odds = 0.0;
};

/// The landmarks that most likely are one by the joint belief: no two that one scan has both seen,
/// and so that each pair fits what the pairs before it leave of the belief (joint compatibility,
/// Neira, Tardos 2001). None unless they are more likely than kSureLogOdds to be one, and by as
/// much more likely than any other choice that would put the robot elsewhere.
Duplicates find_duplicates(const ReassociationOptions& options, const SmoothingGraph& graph,
                           const JointBelief& belief);

/// What was said of the second of each pair is said of the first from now on, and nothing of the
/// second any more.
void merge_landmarks(const std::vector<std::pair<int, int>>& pairs, SmoothingGraph* graph);

}  // namespace pf_resampling
