#include "tools/common/filter_topics.hpp"

#include <algorithm>
#include <type_traits>

#include "pf_resampling_core/error.hpp"
#include "src/messages/conversions.hpp"
#include "src/messages/foreign_messages.hpp"
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

/// Reads a message of another package by its definition. Those who go through a bag name it.
template <typename Read>
auto read_foreign(const rosbag::MessageInstance& message, const Read& read) {
  try {
    return read(*message.instantiate<topic_tools::ShapeShifter>());
  } catch (const Error& error) {
    throw rosbag::BagFormatException("a message on " + message.getTopic() + ": " + error.what());
  }
}

/// Odometry, also where it is said as a pose.
template <typename Message>
auto odometry_reader(const std::string& base) {
  return [base](const rosbag::MessageInstance& message) -> std::optional<Message> {
    using Pose = geometry_msgs::PoseWithCovarianceStamped;
    if (const auto pose = message_in<Pose>(message)) {
      return Message(nav_msgs::Odometry::ConstPtr(
          boost::make_shared<nav_msgs::Odometry>(to_odometry_message(*pose, base))));
    }
    return read_as<Message, nav_msgs::Odometry>(message);
  };
}

std::optional<BeaconMclMessage> as_range(const BeaconRange& range) {
  return BeaconMclMessage(BeaconRange::ConstPtr(boost::make_shared<BeaconRange>(range)));
}

bool is_of(const std::vector<std::string>& types, const rosbag::MessageInstance& message) {
  return std::find(types.begin(), types.end(), message.getDataType()) != types.end();
}

/// Ranges, also of other packages.
auto range_reader(const std::string& antenna) {
  return [antenna](const rosbag::MessageInstance& message) -> std::optional<BeaconMclMessage> {
    if (!is_of(foreign_range_types(), message))
      return read_as<BeaconMclMessage, BeaconRange>(message);
    return as_range(read_foreign(message, [&](const topic_tools::ShapeShifter& foreign) {
      return range_in(foreign, antenna, message.getTime());
    }));
  };
}

/// Landmarks, also of other packages.
std::optional<FastSlamMessage> read_landmarks(const rosbag::MessageInstance& message) {
  if (!is_of(foreign_landmark_types(), message)) {
    return read_as<FastSlamMessage, LandmarkObservationArray>(message);
  }
  return std::visit(
      [](const auto& seen) {
        using Seen = std::decay_t<decltype(seen)>;
        return FastSlamMessage(typename Seen::ConstPtr(boost::make_shared<Seen>(seen)));
      },
      read_foreign(message, landmarks_in));
}

std::vector<std::string> with(const char* own, std::vector<std::string> foreign) {
  foreign.insert(foreign.begin(), own);
  return foreign;
}

void need_odometry(const rosbag::Bag& bag, const std::string& path, const std::string& topic,
                   OdometrySource source, std::vector<NeededTopic>* needed) {
  if (source == OdometrySource::topic) {
    needed->push_back(
        {topic, {"nav_msgs/Odometry", "geometry_msgs/PoseWithCovarianceStamped"}, "--odom"});
  } else if (!has_topic(bag, "/tf")) {
    throw Error(path + ": there is no /tf, which odometry_input/source tf needs");
  }
}

}  // namespace

std::vector<FilterInput<BeaconMclMessage>> BeaconMclTopics::inputs(
    const std::string& base, const std::string& antenna) const {
  using Message = BeaconMclMessage;
  return {{"/tf_static", read_as<Message, tf2_msgs::TFMessage>},
          {"/tf", read_as<Message, tf2_msgs::TFMessage>},
          {beacons, read_as<Message, BeaconArray>},
          {initial_pose, read_as<Message, geometry_msgs::PoseWithCovarianceStamped>},
          {ranges, range_reader(antenna)},
          {sensor_ranges, read_as<Message, sensor_msgs::Range>},
          {imu, read_as<Message, sensor_msgs::Imu>},
          {odom, odometry_reader<Message>(base)}};
}

std::vector<FilterInput<FastSlamMessage>> FastSlamTopics::inputs(const std::string& base) const {
  using Message = FastSlamMessage;
  return {{"/tf_static", read_as<Message, tf2_msgs::TFMessage>},
          {"/tf", read_as<Message, tf2_msgs::TFMessage>},
          {initial_pose, read_as<Message, geometry_msgs::PoseWithCovarianceStamped>},
          {landmarks, read_landmarks},
          {imu, read_as<Message, sensor_msgs::Imu>},
          {odom, odometry_reader<Message>(base)}};
}

void add_beacon_mcl_topics(CommandLine* line) {
  line->topic("odom", BeaconMclTopics().odom, "odometry");
  line->topic("imu", BeaconMclTopics().imu, "IMU, for odometry_input/imu_heading");
  line->topic("ranges", BeaconMclTopics().ranges, "ranges");
  line->topic("sensor-ranges", BeaconMclTopics().sensor_ranges, "ranges as sensor_msgs/Range");
  line->topic("beacons", BeaconMclTopics().beacons, "beacons");
}

BeaconMclTopics beacon_mcl_topics(const CommandLine& line) {
  BeaconMclTopics topics;
  topics.odom = line.topic("odom");
  topics.imu = line.topic("imu");
  topics.ranges = line.topic("ranges");
  topics.sensor_ranges = line.topic("sensor-ranges");
  topics.beacons = line.topic("beacons");
  return topics;
}

FastSlamTopics fastslam_topics(const CommandLine& line) {
  FastSlamTopics topics;
  topics.odom = line.topic("odom");
  topics.imu = line.topic("imu");
  topics.landmarks = line.topic("landmarks");
  return topics;
}

void require_beacon_mcl_topics(const rosbag::Bag& bag, const std::string& path,
                               const BeaconMclTopics& topics, OdometrySource source,
                               bool needs_beacons) {
  std::vector<NeededTopic> needed;
  need_odometry(bag, path, topics.odom, source, &needed);
  if (!has_topic(bag, topics.sensor_ranges, "sensor_msgs/Range")) {
    needed.push_back({topics.ranges, with("pf_resampling/BeaconRange", foreign_range_types()),
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
                             const FastSlamTopics& topics, OdometrySource source,
                             bool needs_landmarks) {
  std::vector<NeededTopic> needed;
  need_odometry(bag, path, topics.odom, source, &needed);
  if (needs_landmarks) {
    needed.push_back({topics.landmarks,
                      with("pf_resampling/LandmarkObservationArray", foreign_landmark_types()),
                      "--landmarks"});
  }
  require_topics(bag, path, needed);
}

}  // namespace pf_resampling
