#pragma once

#include <string>

#include "tools/common/bag.hpp"
#include "tools/common/recording.hpp"

namespace pf_resampling {

/// Writes a new bag of a recording, as the messages that the nodes read, in order of time: odom,
/// ranges, beacons (latched), landmarks, ground_truth, ground_truth_landmarks (latched), tf,
/// tf_static (latched). Bag time is the stamp; maps and frames come a millisecond before all else.
/// Twists are those between two poses of the odometry. A recording that begins at or before time
/// zero, which ROS takes for "no time", is shifted to begin at 1 s. Throws Error if there is
/// nothing in the recording, or a time that ROS cannot hold. The bag appears when it is whole.
void write_recording(const Recording& recording, const std::string& path);

}  // namespace pf_resampling
