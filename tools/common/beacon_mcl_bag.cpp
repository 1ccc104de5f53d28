#include "tools/common/beacon_mcl_bag.hpp"

#include "tools/common/bag.hpp"
#include "tools/common/ordered_bag.hpp"

namespace pf_resampling {
namespace {

bool has_topic(const rosbag::Bag& bag, const std::string& name, const std::string& type) {
  for (const BagTopic& topic : topics_of(bag)) {
    if (topic.name == name && topic.type == type) return true;
  }
  return false;
}

}  // namespace

void require_beacon_mcl_topics(const rosbag::Bag& bag, const std::string& path,
                               const BeaconMclTopics& topics, bool needs_beacons) {
  std::vector<NeededTopic> needed = {{topics.odom, {"nav_msgs/Odometry"}, "--odom"}};
  if (!has_topic(bag, topics.sensor_ranges, "sensor_msgs/Range")) {
    needed.push_back({topics.ranges,
                      {"pf_resampling/BeaconRange"},
                      "--sensor-ranges for sensor_msgs/Range, --ranges"});
  }
  if (needs_beacons) {
    needed.push_back({topics.beacons,
                      {"pf_resampling/BeaconArray"},
                      "a --config file with a list `beacons` does without, --beacons"});
  }
  require_topics(bag, path, needed);
}

std::optional<BeaconMclMessage> to_beacon_mcl_message(const rosbag::MessageInstance& message,
                                                      const BeaconMclTopics& topics) {
  const std::string& topic = message.getTopic();
  if (topic == topics.odom) return instantiate_as<nav_msgs::Odometry, BeaconMclMessage>(message);
  if (topic == topics.ranges) return instantiate_as<BeaconRange, BeaconMclMessage>(message);
  if (topic == topics.sensor_ranges) {
    return instantiate_as<sensor_msgs::Range, BeaconMclMessage>(message);
  }
  if (topic == topics.beacons) return instantiate_as<BeaconArray, BeaconMclMessage>(message);
  if (topic == topics.initial_pose) {
    return instantiate_as<geometry_msgs::PoseWithCovarianceStamped, BeaconMclMessage>(message);
  }
  if (topic == "/tf_static" || topic == "/tf") {
    return instantiate_as<tf2_msgs::TFMessage, BeaconMclMessage>(message);
  }
  return std::nullopt;
}

std::vector<BeaconMclMessage> load_beacon_mcl_messages(const std::string& path,
                                                       const BeaconMclTopics& topics,
                                                       bool needs_beacons) {
  const rosbag::Bag bag = open_bag(path);
  require_beacon_mcl_topics(bag, path, topics, needs_beacons);
  std::vector<BeaconMclMessage> messages;
  for_each_in_order(bag, path, topics.order(), [&](const rosbag::MessageInstance& message) {
    if (auto taken = to_beacon_mcl_message(message, topics)) messages.push_back(*taken);
  });
  return messages;
}

}  // namespace pf_resampling
