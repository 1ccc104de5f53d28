#include "common/beacon_mcl_bag.hpp"

#include <rosbag/exceptions.h>
#include <rosbag/view.h>

#include "common/bag.hpp"
#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

template <typename Message>
std::optional<BeaconMclMessage> instantiate(const rosbag::MessageInstance& message) {
  const auto pointer = message.instantiate<Message>();
  if (!pointer) return std::nullopt;
  return BeaconMclMessage(typename Message::ConstPtr(pointer));
}

}  // namespace

void require_beacon_mcl_topics(const rosbag::Bag& bag, const std::string& path,
                               const BeaconMclTopics& topics, bool needs_beacons) {
  std::vector<NeededTopic> needed = {{topics.odom, {"nav_msgs/Odometry"}, "--odom"},
                                     {topics.ranges, {"pf_resampling/BeaconRange"}, "--ranges"}};
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
  if (topic == topics.odom) return instantiate<nav_msgs::Odometry>(message);
  if (topic == topics.ranges) return instantiate<BeaconRange>(message);
  if (topic == topics.beacons) return instantiate<BeaconArray>(message);
  if (topic == topics.initial_pose) {
    return instantiate<geometry_msgs::PoseWithCovarianceStamped>(message);
  }
  if (topic == "/tf_static" || topic == "/tf") return instantiate<tf2_msgs::TFMessage>(message);
  return std::nullopt;
}

std::vector<BeaconMclMessage> load_beacon_mcl_messages(const std::string& path,
                                                       const BeaconMclTopics& topics,
                                                       bool needs_beacons) {
  const rosbag::Bag bag = open_bag(path);
  require_beacon_mcl_topics(bag, path, topics, needs_beacons);
  std::vector<BeaconMclMessage> messages;
  try {
    for (const rosbag::MessageInstance& message : rosbag::View(bag)) {
      if (auto taken = to_beacon_mcl_message(message, topics)) messages.push_back(*taken);
    }
  } catch (const rosbag::BagException& error) {
    throw Error(path + ": cannot be read to its end (" + error.what() + "); try: rosbag reindex " +
                path);
  }
  return messages;
}

}  // namespace pf_resampling
