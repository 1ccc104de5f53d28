#pragma once

#include <Eigen/Core>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {

/// What a filter believes of the robot's pose, in the map frame.
struct PoseEstimate {
  Pose2 mean;  ///< weighted mean; the heading on the circle
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of (x, y, heading), about that mean
};

/// Draws particles `begin` to `end` - 1 from the Gaussian, which may be singular; each has its own
/// numbers of the stream.
void draw_poses(const PoseEstimate& belief, const RandomStream& normals, Eigen::Index begin,
                Eigen::Index end, Eigen::ArrayXd* x, Eigen::ArrayXd* y, Eigen::ArrayXd* heading);

class Archive;
/// As it is saved.
void describe(Archive& archive, PoseEstimate& estimate);

}  // namespace pf_resampling
