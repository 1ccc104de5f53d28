#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "pf_resampling_core/evaluation/stamped_path.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "tools/worlds/recording.hpp"

namespace pf_resampling {

/// The odometry of a recording as a path in a frame of its own.
inline std::vector<EstimatedPose> odometry_of(const Recording& recording) {
  std::vector<EstimatedPose> path;
  for (const auto& odometry : recording.odometry) {
    path.emplace_back();
    path.back().time = odometry.time;
    path.back().pose = odometry.pose;
  }
  return path;
}

/// The truth while there is odometry.
inline std::vector<TruePose> truth_of(const Recording& recording) {
  std::vector<TruePose> truth;
  for (const auto& pose : recording.truth) {
    if (pose.time < recording.odometry.front().time || pose.time > recording.odometry.back().time) {
      continue;
    }
    truth.push_back({pose.time, pose.pose.x, pose.pose.y, std::nullopt});
    if (std::isfinite(pose.pose.heading)) truth.back().heading = pose.pose.heading;
  }
  return truth;
}

/// Leaves out what is later than `end` (s).
template <typename Entry>
void cut(double end, std::vector<Entry>* entries) {
  entries->erase(std::remove_if(entries->begin(), entries->end(),
                                [end](const Entry& entry) { return entry.time > end; }),
                 entries->end());
}

/// Sets the clock forward by so much (s) at `time`: what is later, is later by that.
template <typename Entry>
void set_clock(double time, double forward, std::vector<Entry>* entries) {
  for (Entry& entry : *entries) {
    if (entry.time > time) entry.time += forward;
  }
}

/// m.
inline double distance(const EstimatedPose& a, const EstimatedPose& b) {
  return std::hypot(a.pose.x - b.pose.x, a.pose.y - b.pose.y);
}

}  // namespace pf_resampling
