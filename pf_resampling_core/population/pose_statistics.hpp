#pragma once

#include <Eigen/Core>

#include "pf_resampling_core/parallel/worker_pool.hpp"
#include "pf_resampling_core/population/pose_estimate.hpp"
#include "pf_resampling_core/population/weights.hpp"

namespace pf_resampling {

/// First and second moments of weighted poses.
struct PoseStatistics : PoseEstimate {
  double effective_sample_size = 0.0;  ///< Kwak eq. 4
};

/// Moments of the whole set: mean and covariance belong together, also when the set has several
/// modes. The heading's deviation is the angle to the mean direction, in [-pi, pi]. `weights`
/// normalised; sizes equal and not zero. `pool`: shares the work out.
PoseStatistics pose_statistics(ConstArray weights, ConstArray x, ConstArray y, ConstArray heading,
                               WorkerPool* pool = nullptr);

}  // namespace pf_resampling
