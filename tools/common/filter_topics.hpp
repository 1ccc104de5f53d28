#pragma once

#include <rosbag/bag.h>
#include <rosbag/message_instance.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"
#include "fastslam_node/fastslam_pipeline.hpp"
#include "tools/common/command_line.hpp"

namespace pf_resampling {

/// A topic that a filter reads from a bag, and how its messages are read; `Message` is a variant of
/// pointers to the messages that the filter takes.
template <typename Message>
struct FilterInput {
  std::string topic;
  std::function<std::optional<Message>(const rosbag::MessageInstance& message)> read;
};

/// Names of the topics that range-beacon localization reads from a bag.
struct BeaconMclTopics {
  std::string odom = "/odom";
  std::string imu = "/imu";
  std::string ranges = "/ranges";
  std::string sensor_ranges = "/sensor_ranges";  ///< of sensor_msgs/Range
  std::string beacons = "/beacons";
  std::string initial_pose = "/initialpose";

  /// In the order in which messages of the same time are taken. `base`, `antenna`: frames of the
  /// robot and of the antenna, for what does not say its own.
  std::vector<FilterInput<BeaconMclMessage>> inputs(const std::string& base,
                                                    const std::string& antenna) const;
};

/// Names of the topics that FastSLAM reads from a bag.
struct FastSlamTopics {
  std::string odom = "/odom";
  std::string imu = "/imu";
  std::string landmarks = "/landmarks";
  std::string initial_pose = "/initialpose";

  /// Likewise.
  std::vector<FilterInput<FastSlamMessage>> inputs(const std::string& base) const;
};

/// Adds the options --odom, --imu, --ranges, --sensor-ranges and --beacons.
void add_beacon_mcl_topics(CommandLine* line);
BeaconMclTopics beacon_mcl_topics(const CommandLine& line);
/// Of the options --odom, --imu and --landmarks.
FastSlamTopics fastslam_topics(const CommandLine& line);

/// Throws Error unless the bag has odometry from its `source`, ranges of either type, and beacons
/// where `needs_beacons`.
void require_beacon_mcl_topics(const rosbag::Bag& bag, const std::string& path,
                               const BeaconMclTopics& topics, OdometrySource source,
                               bool needs_beacons);
/// Throws Error unless the bag has odometry and, where `needs_landmarks`, landmark observations.
void require_fastslam_topics(const rosbag::Bag& bag, const std::string& path,
                             const FastSlamTopics& topics, OdometrySource source,
                             bool needs_landmarks);

template <typename Message>
std::vector<std::string> names_of(const std::vector<FilterInput<Message>>& inputs) {
  std::vector<std::string> names;
  for (const FilterInput<Message>& input : inputs) names.push_back(input.topic);
  return names;
}

/// The message as the filter takes it; nothing if it takes none of its topic and type.
template <typename Message>
std::optional<Message> to_message(const rosbag::MessageInstance& message,
                                  const std::vector<FilterInput<Message>>& inputs) {
  for (const FilterInput<Message>& input : inputs) {
    if (input.topic == message.getTopic()) return input.read(message);
  }
  return std::nullopt;
}

}  // namespace pf_resampling
