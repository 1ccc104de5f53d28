#include "tools/common/bag_contents.hpp"

#include <geometry_msgs/PoseStamped.h>
#include <gtest/gtest.h>
#include <nav_msgs/Path.h>
#include <pf_resampling/BeaconArray.h>
#include <pf_resampling/LandmarkMap.h>
#include <std_msgs/String.h>

#include <cmath>
#include <functional>
#include <string>

#include "pf_resampling_core/error.hpp"
#include "test/temporary_directory.hpp"

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
  EXPECT_EQ(error_of(other, read_truth), ": /topic is empty: it needs at least one pose");
  EXPECT_EQ(error_of(other, read_poses), ": /topic is empty: it needs at least one pose");
}

TEST(BagContents, WithWhatIsNotFiniteTheBagIsNamed) {
  geometry_msgs::PoseStamped pose;
  pose.header.stamp = ros::Time(1.0);
  pose.pose.orientation.w = 1.0;
  pose.pose.position.x = std::nan("");
  const std::string not_finite = ": /topic: pose 1 of 1 is not finite (time 1.000000 s)";
  EXPECT_EQ(error_of(pose, read_truth), not_finite);
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
  map.landmarks[0].covariance[3] = HUGE_VAL;
  EXPECT_EQ(error_of(map, read_landmark_map), ": /topic: landmark 9 is not finite");
}

}  // namespace
}  // namespace pf_resampling
