// The program simulate_bag, run as a user runs it.
#include <geometry_msgs/PoseStamped.h>
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <pf_resampling/BeaconArray.h>
#include <pf_resampling/BeaconRange.h>
#include <pf_resampling/LandmarkMap.h>
#include <pf_resampling/LandmarkObservationArray.h>
#include <rosbag/view.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "pf_resampling_core/test/says.hpp"
#include "pf_resampling_core/test/temporary_directory.hpp"
#include "src/messages/conversions.hpp"
#include "test/bag_topics.hpp"
#include "test/run_program.hpp"
#include "tools/common/files.hpp"

namespace pf_resampling {
namespace {

class SimulateBag : public testing::Test {
 protected:
  TemporaryDirectory directory_;

  std::string simulate(const std::string& arguments, const std::string& name) const {
    std::string path = directory_.file(name);
    const std::size_t space = arguments.find(' ');
    const std::string world = arguments.substr(0, space);
    const std::string options = space == std::string::npos ? "" : arguments.substr(space);
    const ProgramResult result = run_program("simulate_bag " + world + " " + path + options);
    EXPECT_EQ(result.exit_code, 0) << result.error;
    EXPECT_EQ(result.error, "");
    return path;
  }

  template <typename Message>
  static std::vector<Message> messages(const std::string& path, const std::string& topic) {
    const rosbag::Bag bag = open_bag(path);
    std::vector<Message> found;
    rosbag::View view(bag, rosbag::TopicQuery(topic));
    for (const rosbag::MessageInstance& instance : view) {
      const auto message = instance.instantiate<Message>();
      EXPECT_TRUE(message) << topic;
      if (message) found.push_back(*message);
    }
    return found;
  }
};

TEST_F(SimulateBag, WritesWhatTheWorldSays) {
  const std::string path = simulate("beacons_circle --duration 60", "circle.bag");
  auto counts = counts_of(path);
  EXPECT_EQ(counts["/odom"], 601u);    // 10 per second, and one at the start
  EXPECT_EQ(counts["/ranges"], 360u);  // 6 per second
  EXPECT_EQ(counts["/ground_truth"], 601u);
  EXPECT_EQ(counts["/tf"], 601u);
  EXPECT_EQ(latched_in(path), (std::set<std::string>{"/beacons", "/tf_static"}));

  const auto arrays = messages<BeaconArray>(path, "/beacons");
  ASSERT_EQ(arrays.size(), 1u);
  EXPECT_EQ(arrays[0].header.frame_id, "map");
  ASSERT_EQ(arrays[0].beacons.size(), 6u);
  const auto placed = messages<tf2_msgs::TFMessage>(path, "/tf_static");
  ASSERT_EQ(placed.at(0).transforms.size(), 1u);
  EXPECT_EQ(placed[0].transforms[0].header.frame_id, "base_link");
  EXPECT_EQ(placed[0].transforms[0].child_frame_id, "antenna");
  const auto ranges = messages<BeaconRange>(path, "/ranges");
  EXPECT_EQ(ranges[0].header.frame_id, "antenna");
  EXPECT_EQ(ranges[0].variance, 0.0);

  const auto odometry = messages<nav_msgs::Odometry>(path, "/odom");
  EXPECT_EQ(odometry.front().header.frame_id, "odom");
  EXPECT_EQ(odometry.front().child_frame_id, "base_link");
  EXPECT_EQ(odometry.front().pose.pose.position.x, 0.0);
  const auto truth = messages<geometry_msgs::PoseStamped>(path, "/ground_truth");
  EXPECT_EQ(truth.front().header.frame_id, "map");
  EXPECT_NEAR(truth.front().pose.position.x, 25.0, 1e-9);  // start of config/worlds/beacons_circle
  EXPECT_NEAR(truth.front().pose.position.y, 15.0, 1e-9);
}

// Readers of bags see equal times in any order: what explains the rest has to have an earlier one.
TEST_F(SimulateBag, BagTimeIsTheStampAndMapsAndFramesComeBeforeAllElse) {
  const rosbag::Bag bag = open_bag(simulate("indoor_two_loops --duration 5", "loops.bag"));
  const std::set<std::string> is_static = {"/ground_truth_landmarks", "/tf_static"};
  ros::Time first = ros::TIME_MAX;
  for (const rosbag::MessageInstance& instance : rosbag::View(bag)) {
    if (is_static.count(instance.getTopic()) > 0) {
      EXPECT_LT(instance.getTime(), ros::Time(1.0));
      continue;
    }
    first = std::min(first, instance.getTime());
    const auto odometry = instance.instantiate<nav_msgs::Odometry>();
    EXPECT_TRUE(!odometry || instance.getTime() == odometry->header.stamp);
    const auto scan = instance.instantiate<LandmarkObservationArray>();
    EXPECT_TRUE(!scan || instance.getTime() == scan->header.stamp);
  }
  EXPECT_EQ(first, ros::Time(1.0));
  const auto odometry = messages<nav_msgs::Odometry>(bag.getFileName(), "/odom");
  const Pose2 before = to_pose2(odometry[40].pose.pose), now = to_pose2(odometry[41].pose.pose);
  EXPECT_NEAR(odometry[41].twist.twist.linear.x, relative(before, now).x / 0.025, 1e-6);
  EXPECT_NEAR(odometry[41].twist.twist.angular.z, relative(before, now).heading / 0.025, 1e-6);
}

TEST_F(SimulateBag, SameSeedSameBytesAndAnotherSeedOthers) {
  const std::string first = read_file(simulate("beacons_circle --duration 30 --seed 7", "1.bag"));
  const std::string again = read_file(simulate("beacons_circle --duration 30 --seed 7", "2.bag"));
  const std::string other = read_file(simulate("beacons_circle --duration 30 --seed 8", "3.bag"));
  EXPECT_TRUE(first == again);
  EXPECT_FALSE(first == other);
}

TEST_F(SimulateBag, TakesAWorldOfTheUserWithLandmarks) {
  const std::string world = directory_.file("world.yaml");
  write_file(world,
             "waypoints: [[0, 0], [20, 0]]\n"
             "landmarks: [[5, 1], [15, -1]]\n"
             "robot:\n"
             "  speed: 2.0\n"
             "  control_period: 0.05\n"
             "  observation_period: 0.2\n"
             "  sensor: {range_max: 30, range_noise: 0.1, bearing_noise: 0.01}\n");
  const std::string path = simulate(world, "own.bag");
  const auto map = messages<LandmarkMap>(path, "/ground_truth_landmarks");
  ASSERT_EQ(map.size(), 1u);
  ASSERT_EQ(map[0].landmarks.size(), 2u);
  EXPECT_EQ(map[0].landmarks[1].id, 1);
  EXPECT_EQ(map[0].landmarks[1].position.x, 15.0);
  const auto scans = messages<LandmarkObservationArray>(path, "/landmarks");
  ASSERT_FALSE(scans.empty());
  EXPECT_EQ(scans[0].header.frame_id, "sensor");
  ASSERT_EQ(scans[0].observations.size(), 2u);
  EXPECT_NEAR(scans[0].observations[0].range_variance, 0.01, 1e-12);
}

TEST_F(SimulateBag, RepeatsADriveThatEnds) {
  const std::string world = directory_.file("world.yaml");
  write_file(world, "waypoints: [[0, 0], [20, 0]]\nrobot: {speed: 2.0, control_period: 0.05}\n");
  // 20 m at 2 m/s, as often as it takes.
  const auto once = messages<geometry_msgs::PoseStamped>(
      simulate(world + " --duration 60", "1.bag"), "/ground_truth");
  EXPECT_LT((once.back().header.stamp - once.front().header.stamp).toSec(), 10.1);
  const auto again = messages<geometry_msgs::PoseStamped>(
      simulate(world + " --duration 60 --repeat", "again.bag"), "/ground_truth");
  EXPECT_NEAR((again.back().header.stamp - again.front().header.stamp).toSec(), 60.0, 1e-6);
  int turns = 0;  // at the ends, one after the other
  bool is_far = false;
  for (const auto& truth : again) {
    const double x = truth.pose.position.x;
    if (is_far ? x > 3.0 : x < 17.0) continue;
    is_far = !is_far;
    ++turns;
  }
  EXPECT_GE(turns, 4);
  EXPECT_LE(turns, 6);
  expect_failure("simulate_bag " + world + " " + world + ".bag --repeat", 1, {});
}

TEST_F(SimulateBag, HidesIds) {
  const std::string known = simulate("indoor_two_loops --duration 10", "known.bag");
  const std::string unknown = simulate("indoor_two_loops --duration 10 --unknown-ids", "no.bag");
  const auto seen = messages<LandmarkObservationArray>(known, "/landmarks");
  const auto hidden = messages<LandmarkObservationArray>(unknown, "/landmarks");
  ASSERT_EQ(seen.size(), hidden.size());
  ASSERT_FALSE(seen.empty());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    ASSERT_EQ(seen[i].observations.size(), hidden[i].observations.size());
    for (std::size_t k = 0; k < seen[i].observations.size(); ++k) {
      EXPECT_GE(seen[i].observations[k].id, 0);
      EXPECT_EQ(hidden[i].observations[k].id, -1);
      EXPECT_EQ(seen[i].observations[k].range, hidden[i].observations[k].range);
    }
  }
}

TEST_F(SimulateBag, OdometryStatesItsNoise) {
  const std::string path = simulate("indoor_two_loops --duration 5", "noise.bag");
  const auto odometry = messages<nav_msgs::Odometry>(path, "/odom");
  // A message per control: 0.3 m/s and 3 deg/s of Kwak (2008), section 4.
  EXPECT_NEAR(odometry.back().twist.covariance[0], 0.09, 1e-9);
  EXPECT_NEAR(odometry.back().twist.covariance[35], std::pow(3.0 * M_PI / 180.0, 2), 1e-6);
  EXPECT_EQ(odometry.back().twist.covariance[7], 0.0);
}

TEST_F(SimulateBag, SaysInOneLineWhatIsWrong) {
  const std::string out = directory_.file("out.bag");
  const auto expect_refused = [](const std::string& arguments, int exit_code,
                                 const std::string& words) {
    expect_failure("simulate_bag " + arguments, exit_code, {words});
  };
  const std::string bad =
      directory_.write("bad.yaml", "waypoints: [[0, 0]]\nrobot:\n  speed: quick\n");
  expect_refused("beacons_square " + out, 1, "beacons_circle, beacons_figure8");
  expect_refused(directory_.file("missing.yaml") + " " + out, 1, "missing.yaml");
  expect_refused(bad + " " + out, 1, "bad.yaml, line 3: robot/speed");
  expect_refused("beacons_circle " + out + " --duration 1e300", 1, "duration");
  expect_refused("beacons_circle /nowhere/out.bag --duration 1", 1, "/nowhere/out.bag");
  for (const char* options :
       {"--seed x", "--seed -1", "--duration 0", "--duration nan", "--beacon 1"}) {
    expect_refused("beacons_circle " + out + " " + options, 2, "");
  }
  expect_refused("beacons_circle", 2, "out.bag");
}

}  // namespace
}  // namespace pf_resampling
