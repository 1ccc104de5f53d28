#include "tools/worlds/recording_to_bag.hpp"

#include <geometry_msgs/PoseStamped.h>
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <pf_resampling/BeaconArray.h>
#include <pf_resampling/BeaconRange.h>
#include <pf_resampling/LandmarkMap.h>
#include <pf_resampling/LandmarkObservationArray.h>
#include <rosbag/view.h>
#include <tf2_msgs/TFMessage.h>

#include <cmath>
#include <string>
#include <vector>

#include "pf_resampling_core/test/temporary_directory.hpp"
#include "test/bag_topics.hpp"

namespace pf_resampling {
namespace {

/// The messages of a topic.
template <typename Message>
std::vector<Message> messages_of(const rosbag::Bag& bag, const std::string& topic) {
  std::vector<Message> messages;
  for (const rosbag::MessageInstance& instance : rosbag::View(bag, rosbag::TopicQuery(topic))) {
    const auto message = instance.instantiate<Message>();
    if (message != nullptr) messages.push_back(*message);
  }
  return messages;
}

Recording small_recording() {
  Recording recording;
  recording.odometry = {
      {10.0, {0.0, 0.0, 0.0}}, {10.5, {1.0, 0.0, kPi / 2}}, {11.0, {1.0, 1.0, kPi / 2}}};
  recording.odometry_noise = {0.1, 0.2, 0.3};
  recording.ranges = {{10.2, "antenna", 4, 3.5}, {10.5, "antenna_2", 7, 2.5}};
  recording.beacons = {{4, {1.0, 2.0, 0.3}, false}, {7, {3.0, 4.0, 5.0}, false}};
  recording.scans = {{10.5, "sensor", {{1, 2.0, 0.1, 0.01, 0.02}, {-1, 3.0, -0.2}}},
                     {10.9, "sensor", {{2, 4.0, 0.3}}}};
  recording.landmarks = {{1, {6.0, 7.0}}};
  recording.truth = {{10.0, {5.0, 6.0, kPi}}, {11.0, {4.0, 5.0, kPi}}};
  recording.frames["antenna"] =
      Eigen::Translation3d(0.1, 0.2, 0.3) * Eigen::AngleAxisd(kPi / 2, Eigen::Vector3d::UnitZ());
  return recording;
}

TEST(WriteRecording, EveryMessageComesBack) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("a.bag");
  write_recording(small_recording(), path);
  EXPECT_EQ(directory.listing(), "a.bag");
  const rosbag::Bag bag = open_bag(path);

  const auto odometry = messages_of<nav_msgs::Odometry>(bag, "/odom");
  ASSERT_EQ(odometry.size(), 3U);
  EXPECT_EQ(odometry[1].header.stamp, ros::Time(10.5));
  EXPECT_EQ(odometry[1].header.frame_id, "odom");
  EXPECT_EQ(odometry[1].child_frame_id, "base_link");
  EXPECT_DOUBLE_EQ(odometry[1].pose.pose.position.x, 1.0);
  EXPECT_DOUBLE_EQ(odometry[1].pose.pose.orientation.z, std::sqrt(0.5));
  EXPECT_DOUBLE_EQ(odometry[1].pose.pose.orientation.w, std::sqrt(0.5));
  // One metre in half a second, and a quarter of a turn; then one metre ahead.
  EXPECT_DOUBLE_EQ(odometry[1].twist.twist.linear.x, 2.0);
  EXPECT_DOUBLE_EQ(odometry[1].twist.twist.angular.z, kPi);
  EXPECT_NEAR(odometry[2].twist.twist.linear.x, 2.0, 1e-12);
  EXPECT_NEAR(odometry[2].twist.twist.linear.y, 0.0, 1e-12);
  // Of means over half a second.
  EXPECT_NEAR(odometry[2].twist.covariance[0], 0.02, 1e-12);
  EXPECT_NEAR(odometry[2].twist.covariance[7], 0.08, 1e-12);
  EXPECT_NEAR(odometry[2].twist.covariance[35], 0.18, 1e-12);

  const auto ranges = messages_of<BeaconRange>(bag, "/ranges");
  ASSERT_EQ(ranges.size(), 2U);
  EXPECT_EQ(ranges[0].header.stamp, ros::Time(10.2));
  EXPECT_EQ(ranges[0].header.frame_id, "antenna");
  EXPECT_EQ(ranges[1].header.frame_id, "antenna_2");
  EXPECT_EQ(ranges[1].beacon, 7);
  EXPECT_EQ(ranges[1].range, 2.5);
  EXPECT_EQ(ranges[1].variance, 0.0);

  const auto beacons = messages_of<BeaconArray>(bag, "/beacons");
  ASSERT_EQ(beacons.size(), 1U);
  EXPECT_EQ(beacons[0].header.frame_id, "map");
  ASSERT_EQ(beacons[0].beacons.size(), 2U);
  EXPECT_EQ(beacons[0].beacons[0].id, 4);
  EXPECT_EQ(beacons[0].beacons[0].position.z, 0.3);
  EXPECT_EQ(beacons[0].beacons[1].position.z, 5.0);

  const auto scans = messages_of<LandmarkObservationArray>(bag, "/landmarks");
  ASSERT_EQ(scans.size(), 2U);
  EXPECT_EQ(scans[0].header.frame_id, "sensor");
  ASSERT_EQ(scans[0].observations.size(), 2U);
  EXPECT_EQ(scans[0].observations[0].bearing_variance, 0.02);
  EXPECT_EQ(scans[0].observations[1].id, -1);
  ASSERT_EQ(scans[1].observations.size(), 1U);
  EXPECT_EQ(scans[1].observations[0].range, 4.0);

  const auto truth = messages_of<geometry_msgs::PoseStamped>(bag, "/ground_truth");
  ASSERT_EQ(truth.size(), 2U);
  EXPECT_EQ(truth[0].pose.position.y, 6.0);
  EXPECT_DOUBLE_EQ(truth[0].pose.orientation.z, 1.0);

  const auto map = messages_of<LandmarkMap>(bag, "/ground_truth_landmarks");
  ASSERT_EQ(map.size(), 1U);
  EXPECT_EQ(map[0].landmarks.at(0).position.y, 7.0);

  const auto transforms = messages_of<tf2_msgs::TFMessage>(bag, "/tf_static");
  ASSERT_EQ(transforms.size(), 1U);
  ASSERT_EQ(transforms[0].transforms.size(), 1U);
  EXPECT_EQ(transforms[0].transforms[0].header.frame_id, "base_link");
  EXPECT_EQ(transforms[0].transforms[0].child_frame_id, "antenna");
  EXPECT_EQ(transforms[0].transforms[0].transform.translation.y, 0.2);
  EXPECT_DOUBLE_EQ(transforms[0].transforms[0].transform.rotation.z, std::sqrt(0.5));
  EXPECT_EQ(messages_of<tf2_msgs::TFMessage>(bag, "/tf").size(), 3U);
}

TEST(WriteRecording, MapsAreLatchedAndNothingElseIs) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("a.bag");
  write_recording(small_recording(), path);
  EXPECT_EQ(latched_in(path),
            (std::set<std::string>{"/beacons", "/ground_truth_landmarks", "/tf_static"}));
}

TEST(WriteRecording, BagTimeIsTheStamp) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("a.bag");
  write_recording(small_recording(), path);
  const rosbag::Bag bag = open_bag(path);
  std::vector<double> times;
  for (const rosbag::MessageInstance& instance :
       rosbag::View(bag, rosbag::TopicQuery(std::vector<std::string>{"/odom", "/landmarks"}))) {
    times.push_back(instance.getTime().toSec());
  }
  EXPECT_EQ(times, (std::vector<double>{10.0, 10.5, 10.5, 10.9, 11.0}));
}

// Readers of bags see equal times in any order: what explains the rest has to have an earlier one.
TEST(WriteRecording, MapsAndFramesAreThereBeforeAllElse) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("a.bag");
  Recording recording = small_recording();
  recording.ranges.insert(recording.ranges.begin(), {10.0, "antenna", 3, 4.0});
  write_recording(recording, path);
  const rosbag::Bag bag = open_bag(path);
  ros::Time last_static;
  ros::Time first_other = ros::TIME_MAX;
  for (const rosbag::MessageInstance& instance : rosbag::View(bag)) {
    const std::string& topic = instance.getTopic();
    if (topic == "/beacons" || topic == "/tf_static" || topic == "/ground_truth_landmarks") {
      last_static = std::max(last_static, instance.getTime());
    } else {
      first_other = std::min(first_other, instance.getTime());
    }
  }
  EXPECT_LT(last_static, first_other);
  EXPECT_EQ(first_other, ros::Time(10.0));
}

}  // namespace
}  // namespace pf_resampling
