#include "tools/common/bag_contents.hpp"

#include <geometry_msgs/PoseStamped.h>
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <nav_msgs/Path.h>
#include <pf_resampling/BeaconArray.h>
#include <pf_resampling/LandmarkMap.h>
#include <std_msgs/String.h>
#include <tf2_msgs/TFMessage.h>

#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/temporary_directory.hpp"

namespace pf_resampling {
namespace {

/// What is said of a bag that has that message on /topic, without the name of the bag, with which
/// it has to begin.
template <typename Message>
std::string error_of(const Message& message,
                     const std::function<void(const rosbag::Bag&, const std::string&)>& read) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("a.bag");
  rosbag::Bag(path, rosbag::bagmode::Write).write("/topic", ros::Time(1.0), message);
  const rosbag::Bag bag(path);
  try {
    read(bag, "/topic");
  } catch (const Error& error) {
    const std::string what = error.what();
    EXPECT_EQ(what.substr(0, path.size()), path);
    return what.size() < path.size() ? what : what.substr(path.size());
  }
  return "taken";
}

// A recording whose messages are of another version has none that can be read.
TEST(BagContents, WithoutAnyPoseTheBagIsNamed) {
  const std_msgs::String other;
  EXPECT_EQ(error_of(other, read_poses), ": /topic is empty: it needs at least one pose");
}

TEST(BagContents, HeadingsAreThoseOfQuaternionsOfAnyLength) {
  geometry_msgs::PoseStamped pose;
  pose.header.stamp = ros::Time(1.0);
  pose.pose.orientation.z = 2.0 * std::sin(0.35);
  pose.pose.orientation.w = 2.0 * std::cos(0.35);
  const TemporaryDirectory directory;
  const std::string path = directory.file("a.bag");
  rosbag::Bag(path, rosbag::bagmode::Write).write("/topic", ros::Time(1.0), pose);
  const rosbag::Bag bag(path);
  EXPECT_NEAR(read_poses(bag, "/topic").front().pose.heading, 0.7, 1e-12);
}

TEST(BagContents, WithWhatIsNotFiniteTheBagIsNamed) {
  geometry_msgs::PoseStamped pose;
  pose.header.stamp = ros::Time(1.0);
  pose.pose.orientation.w = 1.0;
  pose.pose.position.x = std::nan("");
  const std::string not_finite = ": /topic: pose 1 of 1 is not finite (time 1.000000 s)";
  EXPECT_EQ(error_of(pose, read_poses), not_finite);
  nav_msgs::Path path;
  path.poses.push_back(pose);
  EXPECT_EQ(error_of(path, read_path), not_finite);

  BeaconArray beacons;
  beacons.beacons.resize(1);
  beacons.beacons[0].id = 7;
  beacons.beacons[0].position.y = std::nan("");
  EXPECT_EQ(error_of(beacons, read_beacons), ": /topic: the position of beacon 7 is not finite");

  LandmarkMap map;
  map.landmarks.resize(1);
  map.landmarks[0].id = 9;
  map.landmarks[0].position.x = HUGE_VAL;
  EXPECT_EQ(error_of(map, read_landmark_map), ": /topic: landmark 9 is not finite");
}

nav_msgs::Odometry odometry_at(double time, double x) {
  nav_msgs::Odometry odometry;
  odometry.header.stamp = ros::Time(time);
  odometry.header.frame_id = "odom";
  odometry.child_frame_id = "base_link";
  odometry.pose.pose.position.x = x;
  odometry.pose.pose.orientation.w = 1.0;
  odometry.twist.covariance[0] = 0.04;
  return odometry;
}

// A second apart, at these places ahead; the noise of the third is not finite either.
std::string write_odometry(const TemporaryDirectory& directory, const std::vector<double>& places) {
  const std::string path = directory.file("odometry.bag");
  rosbag::Bag bag(path, rosbag::bagmode::Write);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double time = 1.0 + static_cast<double>(i);
    nav_msgs::Odometry odometry = odometry_at(time, places[i]);
    if (i == 2) odometry.twist.covariance[35] = std::nan("");
    bag.write("/odom", ros::Time(time), odometry);
  }
  return path;
}

TEST(BagContents, OdometryIsWithoutWhatFiltersReject) {
  const TemporaryDirectory directory;
  const double nothing = std::nan("");
  const rosbag::Bag bag(write_odometry(directory, {0.5, nothing, 1.5, 1e160, 2.5}));
  const RecordedOdometry odometry = read_odometry(bag, "/odom");
  ASSERT_EQ(odometry.poses.size(), 3U);
  EXPECT_EQ(odometry.poses[1].time, 3.0);
  EXPECT_EQ(odometry.poses[1].pose.x, 1.5);
  EXPECT_EQ(odometry.left_out,
            "2 of 5 messages of /odom left out, which filters reject; of the first, the pose has a "
            "NaN or infinity");

  const TemporaryDirectory other;
  const rosbag::Bag good(write_odometry(other, {0.5, 1.0}));
  EXPECT_EQ(read_odometry(good, "/odom").left_out, "");
}

TEST(BagContents, OdometryOfWhichNothingIsLeftIsAnError) {
  nav_msgs::Odometry odometry = odometry_at(1.0, 0.0);
  odometry.pose.pose.orientation.w = 0.5;
  EXPECT_EQ(
      error_of(odometry, [](const auto& bag, const auto& topic) { read_odometry(bag, topic); }),
      ": 1 of 1 messages of /topic left out, which filters reject; of the first, orientation "
      "(0, 0, 0, 0.5) is not of length 1");
}

TEST(BagContents, NoiseOfOdometryIsWithoutWhatIsNotFinite) {
  const TemporaryDirectory directory;
  const rosbag::Bag bag(write_odometry(directory, {0.5, 1.0, 1.5, 2.0, 2.5}));
  const auto noise = read_odometry_noise(bag, "/odom");
  ASSERT_TRUE(noise);
  EXPECT_NEAR(noise->along, 0.2, 1e-12);  // the root of 0.04 m^2/s^2, over steps of 1 s
  EXPECT_EQ(noise->heading, 0.0);
}

// 0.5 m ahead of its parent.
geometry_msgs::TransformStamped placed(const std::string& parent, const std::string& child) {
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = parent;
  transform.child_frame_id = child;
  transform.transform.translation.x = 0.5;
  transform.transform.rotation.w = 1.0;
  return transform;
}

TEST(FramesOnRobot, AreThoseOfTheNewestTransforms) {
  tf2_msgs::TFMessage message;
  message.transforms = {placed("f1", "f2"), placed("base", "f1"), placed("f2", "f3")};
  message.transforms.push_back(placed("base", "/f2"));
  message.transforms.back().transform.translation.x = 3.0;
  message.transforms.push_back(placed("f1", "f1"));            // nothing
  message.transforms.push_back(placed("elsewhere", "apart"));  // not on the robot
  message.transforms.push_back(placed("f1", "base"));          // a circle
  const TemporaryDirectory directory;
  const std::string path = directory.file("a.bag");
  rosbag::Bag(path, rosbag::bagmode::Write).write("/tf_static", ros::Time(1.0), message);
  const auto frames = read_frames_on_robot(rosbag::Bag(path), "base");
  ASSERT_EQ(frames.size(), 4U);
  EXPECT_EQ(frames.at("base").translation().x(), 0.0);
  EXPECT_EQ(frames.at("f1").translation().x(), 0.5);
  EXPECT_EQ(frames.at("f2").translation().x(), 3.0);
  EXPECT_EQ(frames.at("f3").translation().x(), 3.5);
}

}  // namespace
}  // namespace pf_resampling
