#pragma once

#include <cstdint>
#include <string>

#include "pf_resampling_core/simulation/world.hpp"

namespace pf_resampling {

/// Drives through a world and writes the bag that the robot would have recorded, as the messages
/// that the nodes read, in order of time, and the truth: odom, ranges, beacons (latched),
/// landmarks, ground_truth, ground_truth_landmarks (latched), tf, tf_static (latched). It begins at
/// 1 s, as ROS takes a stamp of zero for none; maps and frames come a millisecond before. Ranges
/// carry no variance, as from a radio that does not know it; twists and landmark observations carry
/// those of the world. Without `with_ids` landmarks have none. The same world and seed give the
/// same bytes. Throws Error (check_world).
void write_simulated_bag(const World& world, std::uint64_t seed, bool with_ids,
                         const std::string& path);

}  // namespace pf_resampling
