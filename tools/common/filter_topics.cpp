#include "tools/common/filter_topics.hpp"

#include "tools/common/bag.hpp"

namespace pf_resampling {
namespace {

/// Reads messages of one type; nothing comes of those of another.
template <typename Message, typename Type>
std::optional<Message> read_as(const rosbag::MessageInstance& message) {
  const auto pointer = message_in<Type>(message);
  if (!pointer) return std::nullopt;
  return Message(typename Type::ConstPtr(pointer));
}

}  // namespace

std::vector<FilterInput<BeaconMclMessage>> BeaconMclTopics::inputs() const {
  using Message = BeaconMclMessage;
  return {{"/tf_static", read_as<Message, tf2_msgs::TFMessage>},
          {"/tf", read_as<Message, tf2_msgs::TFMessage>},
          {beacons, read_as<Message, BeaconArray>},
          {initial_pose, read_as<Message, geometry_msgs::PoseWithCovarianceStamped>},
          {ranges, read_as<Message, BeaconRange>},
          {sensor_ranges, read_as<Message, sensor_msgs::Range>},
          {odom, read_as<Message, nav_msgs::Odometry>}};
}

std::vector<FilterInput<FastSlamMessage>> FastSlamTopics::inputs() const {
  using Message = FastSlamMessage;
  return {{"/tf_static", read_as<Message, tf2_msgs::TFMessage>},
          {"/tf", read_as<Message, tf2_msgs::TFMessage>},
          {initial_pose, read_as<Message, geometry_msgs::PoseWithCovarianceStamped>},
          {landmarks, read_as<Message, LandmarkObservationArray>},
          {odom, read_as<Message, nav_msgs::Odometry>}};
}

void add_beacon_mcl_topics(CommandLine* line) {
  line->topic("odom", BeaconMclTopics().odom, "odometry");
  line->topic("ranges", BeaconMclTopics().ranges, "ranges");
  line->topic("sensor-ranges", BeaconMclTopics().sensor_ranges, "ranges as sensor_msgs/Range");
  line->topic("beacons", BeaconMclTopics().beacons, "beacons");
}

BeaconMclTopics beacon_mcl_topics(const CommandLine& line) {
  BeaconMclTopics topics;
  topics.odom = line.topic("odom");
  topics.ranges = line.topic("ranges");
  topics.sensor_ranges = line.topic("sensor-ranges");
  topics.beacons = line.topic("beacons");
  return topics;
}

FastSlamTopics fastslam_topics(const CommandLine& line) {
  FastSlamTopics topics;
  topics.odom = line.topic("odom");
  topics.landmarks = line.topic("landmarks");
  return topics;
}

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

void require_fastslam_topics(const rosbag::Bag& bag, const std::string& path,
                             const FastSlamTopics& topics, bool needs_landmarks) {
  std::vector<NeededTopic> needed = {{topics.odom, {"nav_msgs/Odometry"}, "--odom"}};
  if (needs_landmarks) {
    needed.push_back({topics.landmarks, {"pf_resampling/LandmarkObservationArray"}, "--landmarks"});
  }
  require_topics(bag, path, needed);
}

std::vector<BeaconMclMessage> load_beacon_mcl_messages(const std::string& path,
                                                       const BeaconMclTopics& topics,
                                                       bool needs_beacons) {
  const rosbag::Bag bag = open_bag(path);
  require_beacon_mcl_topics(bag, path, topics, needs_beacons);
  const auto inputs = topics.inputs();
  std::vector<BeaconMclMessage> messages;
  for_each_in_order(bag, path, names_of(inputs), [&](const rosbag::MessageInstance& message) {
    if (auto taken = to_message(message, inputs)) messages.push_back(*taken);
  });
  return messages;
}

}  // namespace pf_resampling
