#pragma once

#include <Eigen/Core>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/parameters/parameters.hpp"

namespace pf_resampling {

/// Noise of dead reckoning, as variance per distance driven, angle turned and time passed.
struct OdometryNoise {
  /// Standard deviation of the distance after one metre, m/sqrt(m).
  double translation_per_distance = 0.05;
  /// Standard deviation of the sideways offset after one metre, m/sqrt(m).
  double slip_per_distance = 0.05;
  double heading_per_distance = 0.01;   ///< rad/sqrt(m)
  double heading_per_angle = 0.05;      ///< rad/sqrt(rad)
  double heading_per_time = 0.003;      ///< rad/sqrt(s)
  double along_per_time = 0.0;          ///< along the motion, m/sqrt(s): white noise of the speed
  double translation_per_time = 0.005;  ///< along both axes, m/sqrt(s)

  /// Perfect odometry.
  static OdometryNoise none() { return {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0}; }
};

/// The parameters odometry/..., bound to `noise`, which must outlive the list.
void add_parameters(OdometryNoise* noise, ParameterList* parameters);

/// Odometry between two observations, integrated once for all particles: a Gaussian over the motion
/// in the body frame of its start (FastSLAM: Kwak section 2; MCL: Mahmoud section III).
struct OdometryIncrement {
  double duration = 0.0;  ///< s
  Pose2 mean;             ///< motion, in the frame of the robot at the start
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of (x, y, heading)
  /// What wheels that may have slipped add to it.
  Eigen::Matrix3d slip_covariance = Eigen::Matrix3d::Zero();
  /// Derivative of (x, y, heading) by a constant error of the yaw rate, in s·m, s·m, s.
  Eigen::Vector3d yaw_rate_sensitivity = Eigen::Vector3d::Zero();
  /// Likewise by constant relative errors of distances and turns, and by a turn per distance (two
  /// wheels of unequal size, a steering that is not centred).
  Eigen::Vector3d distance_scale_sensitivity = Eigen::Vector3d::Zero();
  Eigen::Vector3d turn_scale_sensitivity = Eigen::Vector3d::Zero();
  Eigen::Vector3d drift_sensitivity = Eigen::Vector3d::Zero();  ///< in m·m, m·m, m
  /// Velocity (x, y, heading) in the body frame of the end, with a memory of kVelocityMemory: this
  /// increment's part of it, and the share of it from before that is left.
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  double velocity_left = 1.0;

  static constexpr double kVelocityMemory = 0.2;  ///< s
  bool is_empty() const { return duration <= 0.0; }
};

/// Appends one step of dead reckoning: `motion` in the body frame at the start of the step, over
/// `duration` seconds. First-order propagation of mean, covariance and sensitivity.
void append(const OdometryNoise& noise, const Pose2& motion, double duration,
            OdometryIncrement* increment);

/// What wheels that may slip add to the covariance of (x, y, heading) in `duration` s at `speed`,
/// m/s: in three seconds at 2 m/s 1.7 m and 0.7 rad.
Eigen::Matrix3d slip_covariance(double speed, double duration);

}  // namespace pf_resampling
