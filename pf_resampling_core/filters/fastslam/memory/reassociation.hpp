#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "pf_resampling_core/filters/fastslam/memory/scans.hpp"
#include "pf_resampling_core/filters/fastslam/memory/segment_equations.hpp"
#include "pf_resampling_core/filters/fastslam/memory/segment_graph.hpp"

namespace pf_resampling {

/// What decides which landmark a sighting is of, where the landmarks have no ids.
struct ReassociationOptions {
  double robust_width = 0.0;  ///< of Cauchy's loss, in standard deviations
  /// Logarithm of the density, per m and rad, of sightings that are of no landmark known: of new
  /// ones, or of none.
  double log_density_of_new = 0.0;
  /// Likewise, of the landmarks that there are.
  double log_density_of_landmarks = 0.0;
  std::size_t most_landmarks = 0;
};

/// What the sightings of a drive are like, whatever they are of.
struct SightingStatistics {
  double range = 1.0;     ///< m, mean
  double variance = 1.0;  ///< m^2, of the place of what was seen, mean
  /// So many sightings say as much as one of whether there is one landmark or two: errors of real
  /// sensors last, and all sightings of a passage may have the same. Sightings per passage, on
  /// average; a passage ends when its landmark was not seen for kPassageGap.
  double redundancy = 1.0;
};
inline constexpr double kPassageGap = 10.0;  // s
SightingStatistics statistics_of(const SegmentGraph& graph, const std::vector<double>& begins);

/// What a sighting adds to association_cost() if it is of this landmark. `pose`: from where, map
/// frame.
double sighting_cost(const ReassociationOptions& options, const SegmentGraph& graph,
                     const Pose2& pose, const SightingFactor& sighting, int landmark);

/// Minus the logarithm of the posterior of estimate and associations, but for a constant: the
/// graph's cost, as solve() found it, and what its associations add to it.
double association_cost(const ReassociationOptions& options, double cost,
                        const SegmentGraph& graph);

/// Minus the logarithm of the evidence for the associations, but for a constant: of how probable
/// they make the data, whatever the estimate (Laplace's approximation). Graphs of the same data can
/// be compared by it, however many landmarks each takes there to be. `log_determinant`: as solve()
/// found it. How well sightings fit counts as a power of its likelihood, one over the redundancy.
double association_evidence(const ReassociationOptions& options,
                            const SightingStatistics& statistics, double cost,
                            double log_determinant, const SegmentGraph& graph);

/// Decides anew, at the graph's estimate, which landmark each sighting is of, or whether it is of
/// none: in every scan the likeliest pairs first, no landmark twice (as Data association by mutual
/// exclusion, Montemerlo 2003, but with all that is known by now). Returns how many changed.
int reassociate(const ReassociationOptions& options, const SegmentGraph& graph, Scans* scans);

/// Logarithm of the odds from which on an association is sure: 20 to 1.
inline constexpr double kSureLogOdds = 3.0;

/// Share of the sightings whose landmark is not sure: another fits nearly as well.
double ambiguous_share(const ReassociationOptions& options, const SegmentGraph& graph,
                       const Scans& scans);

/// Takes what was seen from pose `first` on for sightings of landmarks that were never seen before:
/// each scan's sightings of those seen within kPassageGap that fit best, or of another, which the
/// graph gets; poses by odometry. False, with the scans half done, if there are too many.
bool track_anew(const ReassociationOptions& options, int first, Scans* scans, SegmentGraph* graph);

/// A landmark that the map could do without.
struct Dispensable {
  int landmark = 0;
  int other = 0;      ///< most of its sightings would be of this one
  double cost = 0.0;  ///< what association_cost() would grow by, at the estimate as it is
};

/// The landmarks for which that is least if their scans are shared among the others; the least
/// first, none above `most`. Only those that a scan has seen beside the other, perhaps by mistake:
/// find_duplicates() decides about those that none has.
std::vector<Dispensable> find_dispensable(const ReassociationOptions& options, double redundancy,
                                          const SegmentGraph& graph, const Scans& scans,
                                          double most);

/// Landmarks that are one: pairs of their numbers, the older first.
struct Duplicates {
  std::vector<std::pair<int, int>> pairs;
  /// Logarithm of how much more likely it is that the pairs are one than that they are not, but
  /// for how well the data then fit: -cost.
  double log_prior_odds = 0.0;
  /// With the cost that the belief predicts.
  double log_odds = 0.0;
  /// Of that, what pairs are worth, whatever the others are, that are as near each other as two
  /// sightings of one landmark: they say nothing of where the robot is.
  double log_odds_of_near = 0.0;
};

/// Those of the landmarks in question that most likely are others by the joint belief, which
/// `equations` has factorised: no two that one scan has both seen, and so that each pair fits what
/// the pairs before it leave of the belief (joint compatibility, Neira, Tardos 2001). None unless
/// they are more likely than kSureLogOdds to be one, and by as much more likely than any other
/// choice that would put the robot elsewhere.
Duplicates find_duplicates(const ReassociationOptions& options,
                           const SightingStatistics& statistics, const SegmentGraph& graph,
                           const SegmentEquations& equations, const std::vector<int>& in_question);

}  // namespace pf_resampling
