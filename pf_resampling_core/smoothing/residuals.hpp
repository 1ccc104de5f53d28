#pragma once

#include <Eigen/Core>

#include "pf_resampling_core/smoothing/smoothing_graph.hpp"

namespace pf_resampling {

/// A motion's residual in standard deviations, and its derivatives.
struct MotionResidual {
  Eigen::Vector3d value;
  Eigen::Matrix3d by_from;
  Eigen::Matrix3d by_to;
  Eigen::Matrix<double, 3, kOdometryConstants> by_constants;
};

/// `root`: inverse root of the covariance, see motion_root(). Distances and turns enter as the
/// estimate divided by their scales, not as what was measured times these: the noise of the
/// measurement would pull the scales down, and with them the map. A turn has its share of its scale
/// only, since one within the noise says nothing of it (of a robot that drives straight, any scale
/// is likelier than 1 whose noise is stated too large), unless the scale is off by 0.4 or more:
/// then all turns are wrong.
MotionResidual motion_residual(const MotionFactor& motion, const Eigen::Matrix3d& root,
                               const Pose2& from, const Pose2& to,
                               const SensorConstants& constants);

/// W with Wᵀ·W = (scale²·covariance)⁻¹. To the covariance are added 10 um and 10 urad: odometry
/// that claims to be perfect would leave the poses no freedom.
Eigen::Matrix3d motion_root(const MotionFactor& motion, double scale);

/// A sighting's residual in standard deviations, and its derivatives; the last are by range_scale
/// and bearing_bias.
struct SightingResidual {
  Eigen::Vector2d value;
  Eigen::Matrix<double, 2, 3> by_pose;
  Eigen::Matrix2d by_landmark;
  Eigen::Matrix2d by_constants;
};

/// Range and bearing; for a range of less than five standard deviations the distances along and
/// across the line of sight, since a bearing to what is under the sensor has no derivative.
SightingResidual sighting_residual(const SightingFactor& sighting, const NoiseScales& noise,
                                   const Pose2& pose, const Eigen::Vector2d& landmark,
                                   const SensorConstants& constants);

/// Cauchy's loss: the cost ½ c²·log(1 + r²/c²) of a squared residual, and the weight that a least
/// squares step gives it. A width c of 0: least squares.
double robust_cost(double squared, double width);
double robust_weight(double squared, double width);

}  // namespace pf_resampling
