#pragma once

#include <ros/time.h>

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "pf_resampling_core/files/archive.hpp"
#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {

/// Odometry as it is kept between observations.
struct OdometrySample {
  ros::Time stamp;
  Pose2 received;                             ///< odometry frame
  Pose2 pose;                                 ///< the same, but continuous over jumps
  std::optional<Eigen::Matrix3d> covariance;  ///< as received, of (x, y, heading)
  /// Its growth in the step from the sample before, in the frame of the robot there.
  std::optional<Eigen::Matrix3d> step_covariance;
  bool may_slip = false;          ///< the wheels, in that step
  std::optional<double> heading;  ///< of an IMU; not saved
};

/// What it takes to notice that wheels slip.
struct DrivenSpeed {
  double driven = 0.0;     ///< m/s, the highest speed of the odometry without slips
  double slipping = 0.0;   ///< s, since it was surpassed
  double moving = 0.0;     ///< s, of all steps in which it moved, ...
  std::int64_t moves = 0;  ///< and their count
};

/// How far a filter has come with what it was given, beside its own state.
struct SavedProgress {
  ros::Time first_odometry;
  ros::Time used;                        ///< until when odometry has been used
  ros::Time last_observation;            ///< that was used; zero: none
  double lost_probability = 0.0;         ///< see LostDetector
  double normalized_innovation = 1.0;    ///< likewise
  Pose2 odometry_offset;                 ///< from poses as received to continuous ones
  DrivenSpeed speed;                     ///< see LearntMotion
  std::vector<OdometrySample> odometry;  ///< what is needed from `used` on
};

/// As it is saved in a checkpoint.
void describe(Archive& archive, SavedProgress& progress);
void describe(Archive& archive, OdometrySample& sample);
/// In nanoseconds.
void describe(Archive& archive, ros::Time& stamp);

}  // namespace pf_resampling
