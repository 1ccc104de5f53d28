#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "pf_resampling_core/evaluation/stamped_path.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "tools/worlds/simulated_recording.hpp"

namespace pf_resampling {

/// A drive through a world, which does not say how good its odometry is.
inline Recording drive_through(const World& world, std::uint64_t seed) {
  Recording recording = simulated_recording(world, seed);
  recording.odometry_noise.reset();
  return recording;
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
