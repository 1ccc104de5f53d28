#include "pf_resampling_core/simulation/simulate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <utility>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/says.hpp"

namespace pf_resampling {
namespace {

World square_world() {
  World world;
  world.waypoints = {{10.0, 0.0}, {10.0, 10.0}, {0.0, 10.0}, {0.0, 0.0}};
  world.repeat = true;
  world.duration = 60.0;
  for (int id = 0; id < 3; ++id) {
    SimulatedBeacon beacon;
    beacon.beacon.id = 10 + id;
    beacon.beacon.position = {5.0 * id, -3.0, 2.0};
    beacon.errors.sigma = 0.3;
    world.beacons.push_back(beacon);
  }
  world.ranges.rate = 4.0;
  world.landmarks = {{5.0, 2.0}, {8.0, 5.0}};
  world.landmark_sensor = {0.2, 5.0, kPi, 0.1, 0.02};
  world.odometry.speed_sigma = 0.1;
  world.odometry.yaw_rate_sigma = 0.02;
  return world;
}

TEST(Simulate, SameSeedGivesTheSameNumbersAndAnotherSeedOthers) {
  const World world = square_world();
  const SimulatedDrive first = simulate(world, 1);
  const SimulatedDrive again = simulate(world, 1);
  const SimulatedDrive other = simulate(world, 2);
  ASSERT_EQ(first.odometry.size(), again.odometry.size());
  ASSERT_EQ(first.ranges.size(), again.ranges.size());
  ASSERT_EQ(first.ranges.size(), other.ranges.size());
  for (std::size_t i = 0; i < first.odometry.size(); ++i) {
    ASSERT_EQ(first.odometry[i].pose.x, again.odometry[i].pose.x);
    ASSERT_EQ(first.odometry[i].truth.x, other.odometry[i].truth.x);  // driven as told
  }
  EXPECT_NE(first.odometry.back().pose.x, other.odometry.back().pose.x);
  for (std::size_t i = 0; i < first.ranges.size(); ++i) {
    ASSERT_EQ(first.ranges[i].range, again.ranges[i].range);
    ASSERT_NE(first.ranges[i].range, other.ranges[i].range);
  }
}

TEST(Simulate, RatesAndTurnsAreTheStatedOnes) {
  World world = square_world();
  world.drive.control_period = 0.025;
  world.odometry.period = 0.1;
  const SimulatedDrive drive = simulate(world, 1);
  ASSERT_EQ(drive.odometry.size(), 601u);
  ASSERT_EQ(drive.ranges.size(), 240u);
  ASSERT_EQ(drive.scans.size(), 300u);
  for (std::size_t i = 0; i < drive.odometry.size(); ++i) {
    EXPECT_NEAR(drive.odometry[i].time, 0.1 * static_cast<double>(i), 1e-9);
  }
  for (std::size_t i = 0; i < drive.ranges.size(); ++i) {
    EXPECT_NEAR(drive.ranges[i].time, 0.25 * static_cast<double>(i + 1), 1e-9);
    EXPECT_EQ(drive.ranges[i].beacon, 10 + static_cast<int>(i % 3));
  }
}

TEST(Simulate, WithoutNoiseAllAgreeWithTheTruth) {
  World world = square_world();
  world.start = {1.0, 0.0, 0.5};
  world.odometry = OdometryErrors();
  for (SimulatedBeacon& beacon : world.beacons) beacon.errors.sigma = 0.0;
  world.landmark_sensor.range_sigma = 0.0;
  world.landmark_sensor.bearing_sigma = 0.0;
  const SimulatedDrive drive = simulate(world, 1);
  for (const auto& odometry : drive.odometry) {
    const Pose2 reckoned = compose(world.start, odometry.pose);
    ASSERT_NEAR(reckoned.x, odometry.truth.x, 1e-9);
    ASSERT_NEAR(reckoned.y, odometry.truth.y, 1e-9);
  }
  // Ranges at whole tenths of a second are seen from a pose of the list, the others between two.
  for (const auto& range : drive.ranges) {
    const auto before = static_cast<std::size_t>(range.time / 0.1 + 1e-6);
    const Eigen::Vector3d beacon =
        world.beacons[static_cast<std::size_t>(range.beacon - 10)].beacon.position;
    const auto distance = [&](const Pose2& pose) {
      return (beacon - Eigen::Vector3d(pose.x, pose.y, 0.0)).norm();
    };
    const double at_begin = distance(drive.odometry[before].truth);
    if (std::abs(range.time - drive.odometry[before].time) < 1e-6) {
      ASSERT_NEAR(range.range, at_begin, 1e-6);
    } else {
      const double middle = 0.5 * (at_begin + distance(drive.odometry[before + 1].truth));
      // The middle of a chord is off by period^2 / 8 of the second derivative of the distance,
      // which is at most yaw rate * speed + speed^2 / distance: 0.01 / 8 * (2.09 + 1 / 3) m.
      ASSERT_NEAR(range.range, middle, 3.1e-3);
    }
  }
  for (const auto& scan : drive.scans) {
    const auto index = static_cast<std::size_t>(std::lround(scan.time / 0.1));
    for (const auto& seen : scan.observations) {
      const Pose2 pose = drive.odometry[index].truth;
      const Eigen::Vector2d& landmark = world.landmarks[static_cast<std::size_t>(seen.id)];
      const double direction = pose.heading + seen.bearing;
      ASSERT_NEAR(pose.x + seen.range * std::cos(direction), landmark.x(), 1e-6);
      ASSERT_NEAR(pose.y + seen.range * std::sin(direction), landmark.y(), 1e-6);
    }
  }
}

TEST(Simulate, TellsWhenLoopsAreClosed) {
  World world = square_world();
  world.repeat = false;
  world.duration = 0.0;
  world.closures = {{"B", 2}, {"C", 3}};
  const SimulatedDrive drive = simulate(world, 1);
  ASSERT_EQ(drive.closures.size(), 2u);
  const auto truth_at = [&](double time) {
    return drive.odometry[static_cast<std::size_t>(std::lround(time / 0.1))].truth;
  };
  // The way-point becomes the target when the one before it is reached.
  const Pose2 at_b = truth_at(drive.closures.at("B"));
  EXPECT_LT(std::hypot(at_b.x - 10.0, at_b.y - 10.0), world.drive.reached_distance);
  const Pose2 at_c = truth_at(drive.closures.at("C"));
  EXPECT_LT(std::hypot(at_c.x, at_c.y - 10.0), world.drive.reached_distance);
  const Pose2 end = drive.odometry.back().truth;
  EXPECT_LT(std::hypot(end.x, end.y), world.drive.reached_distance);
}

TEST(Simulate, RefusesADriveThatNeverEnds) {
  World world = square_world();
  world.repeat = false;
  world.duration = 0.0;
  world.drive.control_period = 1.0;
  world.odometry.period = 1.0;
  world.landmark_sensor.period = 0.0;
  world.drive.speed = 20.0;  // so fast that it jumps over its way-points
  world.drive.reached_distance = 0.001;
  EXPECT_THROW(simulate(world, 1), Error);
}

// Each of these would make no sense, run for years, fill the memory, or divide by zero.
TEST(CheckWorld, NamesWhatCannotBeSimulated) {
  EXPECT_NO_THROW(check_world(square_world()));
  const std::pair<const char*, std::function<void(World*)>> cases[] = {
      {"robot/speed is -1", [](World* w) { w->drive.speed = -1.0; }},
      {"robot/speed_floor", [](World* w) { w->drive.speed_floor = 1.5; }},
      {"robot/motion_noise/yaw_rate", [](World* w) { w->odometry.yaw_rate_sigma = NAN; }},
      {"waypoints", [](World* w) { w->waypoints.clear(); }},
      {"closure_B", [](World* w) { w->closures["B"] = 4; }},
      {"duration", [](World* w) { w->duration = 0.0; }},
      {"duration", [](World* w) { w->duration = 1e300; }},
      {"robot/control_period",
       [](World* w) {
         w->duration = 0.0;
         w->repeat = false;
         w->drive.control_period = w->odometry.period = 1e-6;
       }},
      {"odometry/period", [](World* w) { w->odometry.period = 1e9; }},
      {"odometry/period", [](World* w) { w->odometry.period = 0.15; }},
      // None, or less than half a one, of the steps of the drive for each message of odometry.
      {"odometry/period", [](World* w) { w->odometry.period = 0.0; }},
      {"odometry/period", [](World* w) { w->odometry.period = 0.4 * w->drive.control_period; }},
      {"robot/observation_period", [](World* w) { w->landmark_sensor.period = 1e-9; }},
      {"bearing_noise", [](World* w) { w->landmark_sensor.bearing_sigma = -0.1; }},
      {"ranges/rate", [](World* w) { w->ranges.rate = 1e9; }},
      {"ranges/outlier_max", [](World* w) { w->ranges.outlier_share = 0.1; }},
      {"outlier_share",
       [](World* w) {
         w->ranges.outlier_share = w->ranges.reflected_share = 0.6;
         w->ranges.outlier_max = 10.0;
       }},
      {"no beacons", [](World* w) { w->beacons.clear(); }},
      {"beacon 10 is given twice", [](World* w) { w->beacons[1].beacon.id = 10; }},
      {"has a position that is not finite",
       [](World* w) { w->beacons[1].beacon.position.y() = NAN; }},
      {"beacon 12 scale", [](World* w) { w->beacons[2].errors.scale = 0.0; }},
  };
  for (const auto& [name, change] : cases) {
    World world = square_world();
    change(&world);
    EXPECT_TRUE(says(refusal([&] { check_world(world); }), name));
  }
}

}  // namespace
}  // namespace pf_resampling
