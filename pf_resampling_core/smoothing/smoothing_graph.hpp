#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {

class Archive;

/// Errors of the sensors that stay the same for long: unknowns of a SmoothingGraph, each with a
/// Gaussian prior about 0. The first five are those of the odometry, see OdometryErrorOptions.
struct SensorConstant {
  enum Index : int {
    distance_scale,  ///< relative error of distances driven
    turn_scale,      ///< relative error of turns
    drift,           ///< turn per distance, rad/m
    yaw_rate,        ///< turn per time, rad/s
    delay,           ///< of the observations against the odometry, s
    range_scale,     ///< measured over true range, less one
    bearing_bias,    ///< measured less true bearing, rad
  };
};
inline constexpr int kSensorConstants = 7;
inline constexpr int kOdometryConstants = 5;
using SensorConstants = Eigen::Matrix<double, kSensorConstants, 1>;
/// Information on the odometry's constants, or covariance.
using OdometryInformation = Eigen::Matrix<double, kOdometryConstants, kOdometryConstants>;

/// Odometry from a pose to the next:
///   motion = mean + sensitivity · (the odometry's constants) + noise,
/// in the body frame of the former.
struct MotionFactor {
  Pose2 mean;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of (x, y, heading)
  Eigen::Matrix3d slip_covariance =
      Eigen::Matrix3d::Zero();  ///< that slips add, whatever the noise
  Eigen::Matrix<double, 3, kOdometryConstants> sensitivity =
      Eigen::Matrix<double, 3, kOdometryConstants>::Zero();
  double turn_share = 1.0;  ///< of its turn that tells the scale of turns

  /// s: how far a constant turn rate would turn it.
  double duration() const { return sensitivity(2, SensorConstant::yaw_rate); }
};

/// A landmark seen from a pose by a sensor that sits at `sensor` on the robot.
struct SightingFactor {
  int pose = 0;
  int landmark = 0;
  double range = 0.0;             ///< m, > 0
  double bearing = 0.0;           ///< rad, from the sensor's x axis
  double range_variance = 0.0;    ///< m^2, > 0
  double bearing_variance = 0.0;  ///< rad^2, > 0
  Pose2 sensor;
};

/// Factors of the standard deviations as stated: errors of real sensors last, and so many count for
/// less than as many that do not; and what is stated may be too large. Within
/// [kSmallestNoiseScale, kLargestNoiseScale].
struct NoiseScales {
  double range = 1.0;
  double bearing = 1.0;
  double motion = 1.0;
};
inline constexpr double kSmallestNoiseScale = 0.1;
inline constexpr double kLargestNoiseScale = 20.0;

/// What is known at the start about the first pose, and about the constants, whose mean is zero, in
/// this order.
struct GaussianPrior {
  static constexpr int kSize = 3 + kSensorConstants;

  Pose2 pose;
  Eigen::Matrix<double, kSize, kSize> information = Eigen::Matrix<double, kSize, kSize>::Zero();
};

/// The first pose is known to 1e-6 (m, rad), the constants to these standard deviations (at least
/// 1e-9), nothing of landmarks.
GaussianPrior prior_at(const Pose2& first, const SensorConstants& sigma);

/// The data of a drive and the present estimate of all there is to know: poses, landmarks
/// and the sensors' constants. Grows at its end.
struct SmoothingGraph {
  std::vector<Pose2> poses;                ///< m, rad; map frame
  std::vector<Eigen::Vector2d> landmarks;  ///< m
  SensorConstants constants = SensorConstants::Zero();

  GaussianPrior prior;
  std::vector<MotionFactor> motions;      ///< i: from poses[i] to poses[i + 1]
  std::vector<SightingFactor> sightings;  ///< poses ascending

  NoiseScales noise;
};

/// As they are saved: see Archive.
void describe(Archive& archive, MotionFactor& motion);
void describe(Archive& archive, SightingFactor& sighting);
void describe(Archive& archive, NoiseScales& noise);

/// Whether all constants are finite and no scale is a tenth or less of what it should be: division
/// by it would not end well. Only turns may have the wrong sign.
bool are_plausible(const SensorConstants& constants);

/// `mean` of the motion with the constants taken out: where the next pose is expected.
Pose2 corrected_motion(const MotionFactor& motion, const SensorConstants& constants);

}  // namespace pf_resampling
