#pragma once

#include <Eigen/Core>

#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {

/// What a filter believes of the robot's pose, in the map frame.
struct PoseEstimate {
  Pose2 mean;  ///< weighted mean; the heading on the circle
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of (x, y, heading), about that mean
};

class Archive;
/// As it is saved.
void describe(Archive& archive, PoseEstimate& estimate);

}  // namespace pf_resampling
