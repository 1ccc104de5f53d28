#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "pf_resampling_core/files/archive.hpp"
#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {

/// Odometry as it is kept between observations. Stamps are in nanoseconds.
struct SavedOdometry {
  std::int64_t stamp = 0;
  Pose2 received;                                  ///< odometry frame
  Pose2 pose;                                      ///< the same, but continuous over jumps
  std::optional<Eigen::Matrix3d> covariance;       ///< as received, of (x, y, heading)
  std::optional<Eigen::Matrix3d> step_covariance;  ///< of the step from the one before
  bool may_slip = false;                           ///< the wheels, in that step
};

/// How far a filter has come with what it was given, beside its own state. Stamps are in
/// nanoseconds.
struct SavedProgress {
  std::int64_t first_odometry = 0;
  std::int64_t used = 0;                ///< until when odometry has been used
  std::int64_t last_observation = 0;    ///< that was used; 0: none
  double lost_probability = 0.0;        ///< see LostDetector
  double normalized_innovation = 1.0;   ///< likewise
  Pose2 odometry_offset;                ///< from poses as received to continuous ones
  double driven = 0.0;                  ///< m/s, the highest speed of the odometry without slips
  double slipping = 0.0;                ///< s, since it was surpassed
  double moving = 0.0;                  ///< s, of all steps in which it moved, ...
  std::int64_t moves = 0;               ///< and their count
  std::vector<SavedOdometry> odometry;  ///< what is needed from `used` on
};

/// As it is saved in a checkpoint.
void describe(Archive& archive, SavedProgress& progress);
void describe(Archive& archive, SavedOdometry& odometry);

}  // namespace pf_resampling
