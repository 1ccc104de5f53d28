#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "pf_resampling_core/population/pose_estimate.hpp"
#include "pf_resampling_core/population/weights.hpp"

namespace pf_resampling {

/// A place where the robot may be: particles that belong together.
struct PoseCluster {
  double weight = 0.0;  ///< of its particles, of 1
  PoseEstimate pose;    ///< of them alone
};

struct PoseClusters {
  std::vector<PoseCluster> clusters;  ///< the heaviest first
  double rest = 1.0;                  ///< weight of the particles that are in none of them
};

/// The places that fit: particles that are neighbours, or connected by neighbours, make a cluster
/// (as cells that touch do in amcl, after Fox 2003, "Adapting the sample size in particle filters
/// through KLD-sampling"). What is near comes from the spread of the particles and the effective
/// number of them; each cluster is looked at again by its own, so places that are close to each
/// other are told apart in a large area. Two clusters are two places if most of the variance of
/// both together, in position or heading, is that between them. Clusters of less than 2 % of the
/// weight, and those beyond the `most` heaviest, are in the rest.
///
/// The arrays have equal sizes; `weights` are not negative and have a positive sum. m, rad. Same
/// input: same result. Of more than 500 particles, these are picked by their weights.
PoseClusters pose_clusters(ConstArray weights, ConstArray x, ConstArray y, ConstArray heading,
                           int most);

/// "2 places fit: 61 % at (1.20, 3.40) m, 0.50 rad; 39 % at (-5.00, 2.00) m, -1.00 rad"; empty
/// unless there are several.
std::string sentence_of(const PoseClusters& clusters);

}  // namespace pf_resampling
