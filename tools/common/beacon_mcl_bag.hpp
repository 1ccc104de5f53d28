#pragma once

#include <rosbag/bag.h>
#include <rosbag/message_instance.h>
#include <rosbag/view.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "beacon_mcl_node/run_beacon_mcl.hpp"

namespace pf_resampling {

/// Names of the topics that range-beacon localization reads from a bag.
struct BeaconMclTopics {
  std::string odom = "/odom";
  std::string ranges = "/ranges";
  std::string beacons = "/beacons";
  std::string initial_pose = "/initialpose";
};

/// Throws Error unless the bag has odometry and ranges, and beacons where `needs_beacons`.
void require_beacon_mcl_topics(const rosbag::Bag& bag, const std::string& path,
                               const BeaconMclTopics& topics, bool needs_beacons);

/// Hands out every message in order of time. Of those with the same time, what others need comes
/// first (transforms, beacons, ranges, odometry), whatever the order in the file, which rosbag does
/// not tell: so a copy of a bag gives the same result.
void for_each_in_order(rosbag::View* view, const BeaconMclTopics& topics,
                       const std::function<void(const rosbag::MessageInstance&)>& take);

/// The message as the pipeline takes it; nothing if it takes none of its topic and type.
std::optional<BeaconMclMessage> to_beacon_mcl_message(const rosbag::MessageInstance& message,
                                                      const BeaconMclTopics& topics);

/// All of them in order of time, for run_beacon_mcl(). Throws Error that names the file.
std::vector<BeaconMclMessage> load_beacon_mcl_messages(const std::string& path,
                                                       const BeaconMclTopics& topics,
                                                       bool needs_beacons);

}  // namespace pf_resampling
