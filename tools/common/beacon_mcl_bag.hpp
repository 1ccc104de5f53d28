#pragma once

#include <rosbag/bag.h>
#include <rosbag/message_instance.h>

#include <optional>
#include <string>
#include <vector>

#include "beacon_mcl_node/messages_in_memory.hpp"

namespace pf_resampling {

/// Names of the topics that range-beacon localization reads from a bag.
struct BeaconMclTopics {
  std::string odom = "/odom";
  std::string ranges = "/ranges";
  std::string sensor_ranges = "/sensor_ranges";  ///< of sensor_msgs/Range
  std::string beacons = "/beacons";
  std::string initial_pose = "/initialpose";

  /// In which messages of the same time are taken.
  std::vector<std::string> order() const {
    return {"/tf_static", "/tf", beacons, initial_pose, ranges, sensor_ranges, odom};
  }
};

/// Throws Error unless the bag has odometry and ranges of either type, and beacons where
/// `needs_beacons`.
void require_beacon_mcl_topics(const rosbag::Bag& bag, const std::string& path,
                               const BeaconMclTopics& topics, bool needs_beacons);

/// The message as the pipeline takes it; nothing if it takes none of its topic and type.
std::optional<BeaconMclMessage> to_beacon_mcl_message(const rosbag::MessageInstance& message,
                                                      const BeaconMclTopics& topics);

/// All of them in order of time, for run_over_messages(). Throws Error that names the file.
std::vector<BeaconMclMessage> load_beacon_mcl_messages(const std::string& path,
                                                       const BeaconMclTopics& topics,
                                                       bool needs_beacons);

}  // namespace pf_resampling
