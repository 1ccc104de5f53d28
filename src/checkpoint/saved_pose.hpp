#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "pf_resampling_core/files/archive.hpp"
#include "pf_resampling_core/population/pose_estimate.hpp"

namespace pf_resampling {

/// Where the robot was believed to be, and all that is needed to judge later whether it is still
/// there.
struct SavedPose {
  std::string frame;       ///< of the pose: the map frame
  std::string map;         ///< which map that was, in words that another run uses for the same
  std::int64_t stamp = 0;  ///< ns, of the odometry
  PoseEstimate pose;       ///< then
  Pose2 odometry;          ///< what the odometry read then, odometry frame
  bool stood_still = false;
  double lost = 0.0;  ///< probability that the pose was wrong
};

/// How a filter finds things when its odometry begins.
struct PoseAtStart {
  std::string frame;       ///< the map frame
  std::string map;         ///< as in SavedPose; empty: none that another run would know
  std::int64_t stamp = 0;  ///< ns, of the first odometry
  Pose2 odometry;          ///< what it reads
  double oldest = 0.0;     ///< s that a pose may be old
};

/// Why the robot cannot be believed to be where it was, in words; nothing if it can. The pose has
/// to be of the same map and not too old, from a filter that was not lost; and the odometry reads
/// what it read then, or zero after a robot that stood still was switched off and on. All else may
/// be a robot that was moved: an odometer that has gone on looks like one that began anew and was
/// driven.
std::optional<std::string> reason_against(const SavedPose& saved, const PoseAtStart& now);

/// Where the robot is if there is no reason against it: where it was, moved by what the odometry
/// reads more than then.
PoseEstimate pose_at_start(const SavedPose& saved, const Pose2& odometry);

/// As it is saved: see doc/saved_files.md.
void describe(Archive& archive, SavedPose& saved);

/// What is wrong with it, in words; nothing if all is well.
std::string fault_of(const SavedPose& saved);

/// See write_saved() and read_saved().
void write_saved_pose(const std::string& path, const SavedPose& pose);
SavedPose read_saved_pose(const std::string& path);

}  // namespace pf_resampling
