#include "common/beacon_mcl_bag.hpp"

#include <rosbag/exceptions.h>

#include <algorithm>

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

int rank_of(const std::string& topic, const BeaconMclTopics& topics) {
  if (topic == "/tf_static") return 0;
  if (topic == "/tf") return 1;
  if (topic == topics.beacons) return 2;
  if (topic == topics.initial_pose) return 3;
  if (topic == topics.ranges) return 4;
  if (topic == topics.odom) return 5;
  return 6;
}

}  // namespace

void for_each_in_order(rosbag::View* view, const BeaconMclTopics& topics,
                       const std::function<void(const rosbag::MessageInstance&)>& take) {
  // Instances can be copied, but not assigned: their order is that of pointers.
  std::vector<rosbag::MessageInstance> same_time;
  const auto before = [&](const rosbag::MessageInstance* a, const rosbag::MessageInstance* b) {
    const int rank_a = rank_of(a->getTopic(), topics);
    const int rank_b = rank_of(b->getTopic(), topics);
    return rank_a != rank_b ? rank_a < rank_b : a->getTopic() < b->getTopic();
  };
  const auto flush = [&] {
    std::vector<const rosbag::MessageInstance*> order;
    for (const rosbag::MessageInstance& message : same_time) order.push_back(&message);
    std::stable_sort(order.begin(), order.end(), before);
    for (const rosbag::MessageInstance* message : order) take(*message);
    same_time.clear();
  };
  for (const rosbag::MessageInstance& message : *view) {
    if (!same_time.empty() && same_time.back().getTime() != message.getTime()) flush();
    same_time.push_back(message);
  }
  flush();
}

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
    rosbag::View view(bag);
    for_each_in_order(&view, topics, [&](const rosbag::MessageInstance& message) {
      if (auto taken = to_beacon_mcl_message(message, topics)) messages.push_back(*taken);
    });
  } catch (const rosbag::BagException& error) {
    throw Error(path + ": cannot be read to its end (" + error.what() + "); try: rosbag reindex " +
                path);
  }
  return messages;
}

}  // namespace pf_resampling
