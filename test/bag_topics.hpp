#pragma once

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>
#include <pf_resampling/LandmarkMap.h>
#include <rosbag/view.h>
#include <tf2_msgs/TFMessage.h>

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "src/messages/conversions.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/bag_writer.hpp"
#include "tools/common/recording.hpp"

namespace pf_resampling {

/// How many messages a bag has on each topic.
inline std::map<std::string, std::uint64_t> counts_of(const std::string& path) {
  const rosbag::Bag bag = open_bag(path);
  std::map<std::string, std::uint64_t> counts;
  for (const rosbag::MessageInstance& message : rosbag::View(bag)) ++counts[message.getTopic()];
  return counts;
}

/// Writes to another bag what `write` makes of each message.
template <typename Write>
void rewrite_bag(const std::string& in, const std::string& out, const Write& write) {
  const rosbag::Bag bag = open_bag(in);
  BagWriter writer(out);
  for (const rosbag::MessageInstance& message : rosbag::View(bag)) write(message, &writer);
  writer.finish();
}

/// The transform odom -> base that says what a message of odometry says.
inline tf2_msgs::TFMessage as_transform(const nav_msgs::Odometry& odometry) {
  tf2_msgs::TFMessage message;
  message.transforms.resize(1);
  geometry_msgs::TransformStamped& transform = message.transforms.front();
  transform.header = odometry.header;
  transform.child_frame_id = odometry.child_frame_id;
  transform.transform.translation.x = odometry.pose.pose.position.x;
  transform.transform.translation.y = odometry.pose.pose.position.y;
  transform.transform.rotation = odometry.pose.pose.orientation;
  return message;
}

/// The topics of a bag with a message that rosbag play latches.
inline std::set<std::string> latched_in(const std::string& path) {
  const rosbag::Bag bag = open_bag(path);
  std::set<std::string> latched;
  for (const rosbag::MessageInstance& message : rosbag::View(bag)) {
    if (message.isLatching()) latched.insert(message.getTopic());
  }
  return latched;
}

/// The poses of a topic, in order of their stamps.
inline std::vector<StampedPose> read_poses(const rosbag::Bag& bag, const std::string& topic) {
  std::vector<StampedPose> poses;
  for (const rosbag::MessageInstance& instance : rosbag::View(bag, rosbag::TopicQuery(topic))) {
    const auto believed = instance.instantiate<geometry_msgs::PoseWithCovarianceStamped>();
    const auto pose = instance.instantiate<geometry_msgs::PoseStamped>();
    if (pose) poses.push_back({pose->header.stamp.toSec(), to_pose2(pose->pose)});
    if (believed) poses.push_back({believed->header.stamp.toSec(), to_pose2(believed->pose.pose)});
  }
  return poses;
}

/// The landmarks of the last map on a topic.
inline std::vector<PointLandmark> read_landmark_map(const rosbag::Bag& bag,
                                                    const std::string& topic) {
  std::vector<PointLandmark> landmarks;
  for (const rosbag::MessageInstance& instance : rosbag::View(bag, rosbag::TopicQuery(topic))) {
    const auto map = instance.instantiate<LandmarkMap>();
    landmarks.clear();
    for (const Landmark& each : map->landmarks) {
      landmarks.push_back({each.id, {each.position.x, each.position.y}});
    }
  }
  return landmarks;
}

}  // namespace pf_resampling
