#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pf_resampling_core/filters/beacon_mcl/saved_beacon_mcl.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"
#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {

/// Odometry as it is kept between observations. Stamps are in nanoseconds.
struct SavedOdometry {
  std::int64_t stamp = 0;
  Pose2 received;                                  ///< odometry frame
  Pose2 pose;                                      ///< the same, but continuous over jumps
  std::optional<Eigen::Matrix3d> covariance;       ///< as received, of (x, y, heading)
  std::optional<Eigen::Matrix3d> step_covariance;  ///< of the step from the one before
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
  std::vector<SavedOdometry> odometry;  ///< from the last that is not after `used` on
};

/// All that a filter needs to go on as if nothing had happened, with the same configuration and
/// seed; but for observations that waited for odometry.
struct BeaconMclCheckpoint {
  SavedProgress progress;
  SavedBeaconMcl filter;
};
struct FastSlamCheckpoint {
  SavedProgress progress;
  /// Where the robot has been and has seen landmarks, m, map frame.
  Eigen::AlignedBox2d scene = Eigen::AlignedBox2d(Eigen::Vector2d::Zero());
  SavedMap filter;
};

/// What is wrong with it, in words; nothing if all is well.
std::string fault_of(const SavedProgress& progress);
std::string fault_of(const Eigen::AlignedBox2d& scene);

/// Writes a checkpoint as text: see doc/checkpoints.md. Numbers come back to the bit. The file
/// appears whole or not at all: written beside, synchronized, renamed. Throws Error, naming the
/// file, when it cannot be written or the state makes no sense.
void write_checkpoint(const std::string& path, const BeaconMclCheckpoint& checkpoint);
void write_checkpoint(const std::string& path, const FastSlamCheckpoint& checkpoint);

/// Read it. Throw Error, in one line that names file, line, fault and remedy, for anything that
/// write_checkpoint() has not written just so, and for a checkpoint of another filter.
BeaconMclCheckpoint read_beacon_mcl_checkpoint(const std::string& path);
FastSlamCheckpoint read_fastslam_checkpoint(const std::string& path);

}  // namespace pf_resampling
