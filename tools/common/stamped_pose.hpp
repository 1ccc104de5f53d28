#pragma once

#include <vector>

#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {

/// Where the robot was at a time, or is believed to have been.
struct StampedPose {
  double time = 0.0;  ///< s
  Pose2 pose;
};

/// Throws Error unless the path, called `name` in the message, is not empty, finite and in order of
/// time (equal stamps are allowed).
void check_path(const std::vector<StampedPose>& path, const char* name);

/// The path at a time between its first and last: position linear, heading along the shorter arc.
/// Before and after it the pose stays as it is there.
Pose2 pose_at(const std::vector<StampedPose>& path, double time);

}  // namespace pf_resampling
