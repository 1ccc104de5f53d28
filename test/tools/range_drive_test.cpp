#include "tools/common/range_drive.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "pf_resampling_core/error.hpp"
#include "test/batch_testing.hpp"
#include "tools/worlds/world_file.hpp"

namespace pf_resampling {
namespace {

/// Two minutes among beacons, without noise: the radios and the odometry have constant errors.
World exact_world() {
  World world = load_world("beacons_figure8");
  world.duration = 120.0;
  world.odometry.distance_scale = 1.01;
  world.odometry.yaw_scale = 1.0;
  world.odometry.yaw_rate_bias = 0.003;
  world.odometry.yaw_rate_bias_drift = 0.0;
  world.odometry.speed_sigma = world.odometry.lateral_sigma = world.odometry.yaw_rate_sigma = 0.0;
  for (auto& beacon : world.beacons) beacon.errors.sigma = 0.0;
  world.ranges.outlier_share = world.ranges.reflected_share = 0.0;
  return world;
}

double mean_error(const KnownDrive& drive, const std::vector<StampedPose>& path, double clip) {
  EXPECT_EQ(path.size(), drive.odometry.size());
  return path_error(drive, path, clip).mean;
}

TEST(SolveRanges, FindsPathRadiosAndErrorsOfTheOdometry) {
  const World world = exact_world();
  const KnownDrive drive = drive_through(world, 1);
  const RangeSolution solution = solve_ranges(drive);
  EXPECT_LT(mean_error(drive, solution.path, 0.0), 0.02);
  for (const RadioKnowledge& radio : solution.memory.radios()) {
    const auto& truth = world.beacons[static_cast<std::size_t>(radio.id - 1)];
    ASSERT_EQ(radio.id, truth.beacon.id);
    EXPECT_EQ(radio.account, RadioAccount::as_listed);
    EXPECT_NEAR(radio.calibration.scale, truth.errors.scale, 0.005);
    EXPECT_NEAR(radio.calibration.bias, truth.errors.bias, 0.1);
  }
  const Eigen::VectorXd newest = solution.memory.newest(solution.memory.modes().front()).mean;
  EXPECT_NEAR(newest[KeyframeUnknown::count + CommonUnknown::distance_scale], 0.01, 0.002);
  EXPECT_NEAR(newest[KeyframeUnknown::yaw_rate_bias], 0.003, 0.0003);
  EXPECT_EQ(solution.ranges, static_cast<int>(drive.ranges.size()));
  EXPECT_EQ(solution.outliers, 0);
}

TEST(SolveRanges, RangesThatAreWrongHardlyPull) {
  KnownDrive drive = drive_through(exact_world(), 1);
  int wrong = 0;
  for (std::size_t i = 7; i < drive.ranges.size(); i += 23, ++wrong) {
    drive.ranges[i].ranges[0].range += 15.0;
  }
  const RangeSolution solution = solve_ranges(drive);
  EXPECT_EQ(solution.outliers, wrong);
  EXPECT_LT(mean_error(drive, solution.path, 0.0), 0.05);
}

TEST(SolveRanges, AntennasSitAnywhereOnTheRobot) {
  KnownDrive drive = drive_through(exact_world(), 1);
  const Eigen::Vector3d antenna(0.8, -0.6, 1.0);
  for (Beacon& beacon : drive.beacons) {
    beacon.position.z() = 3.0;
    beacon.is_planar = false;
  }
  for (StampedRanges& heard : drive.ranges) {
    const Pose2 place = compose(pose_at(drive.truth, heard.time), {antenna.x(), antenna.y(), 0.0});
    RangeObservation& range = heard.ranges[0];
    range.antenna = antenna;
    for (const Beacon& beacon : drive.beacons) {
      if (beacon.id != range.beacon) continue;
      range.range = std::hypot(place.x - beacon.position.x(), place.y - beacon.position.y(), 2.0);
    }
  }
  const RangeSolution solution = solve_ranges(drive);
  EXPECT_LT(mean_error(drive, solution.path, 0.0), 0.02);
}

// In the frame of the first pose.
TEST(SolveRanges, FindsBeaconsThatAreNotKnown) {
  KnownDrive drive = drive_through(exact_world(), 1);
  const std::vector<Beacon> truth = std::exchange(drive.beacons, {});
  const RangeSolution solution = solve_ranges(drive);
  const PathError aligned = path_error(drive, solution.path, 0.0, true);
  EXPECT_LT(aligned.mean, 0.15);
  for (const RadioKnowledge& radio : solution.memory.radios()) {
    EXPECT_EQ(radio.account, RadioAccount::unlisted);
    ASSERT_EQ(radio.places.size(), 1U);
    const Pose2 place = compose(aligned.alignment,
                                {radio.places[0].position.x(), radio.places[0].position.y(), 0.0});
    const Beacon& beacon = truth[static_cast<std::size_t>(radio.id - 1)];
    EXPECT_LT(std::hypot(place.x - beacon.position.x(), place.y - beacon.position.y()), 0.5);
  }
}

TEST(SolveRanges, NeedsRangesAndOdometry) {
  KnownDrive drive = drive_through(exact_world(), 1);
  drive.ranges.clear();
  EXPECT_THROW(solve_ranges(drive), Error);
  EXPECT_THROW(solve_ranges({}), Error);
}

// The world as it is, to `end` (s).
KnownDrive noisy_drive(double end) {
  World world = load_world("beacons_figure8");
  world.duration = 120.0;
  KnownDrive drive = drive_through(world, 3);
  cut(end, &drive.odometry);
  cut(end, &drive.ranges);
  return drive;
}

TEST(SolveRanges, KnowsThePastOnlyOnLine) {
  const KnownDrive whole = noisy_drive(1e9);
  const double half_time = whole.odometry[whole.odometry.size() / 2].time;
  const OnlineSolution all = solve_ranges(whole).online;
  const OnlineSolution half = solve_ranges(noisy_drive(half_time)).online;
  ASSERT_EQ(all.path.size(), whole.odometry.size());
  for (std::size_t i = 0; i < half.path.size(); ++i) {
    ASSERT_EQ(half.path[i].time, all.path[i].time);
    ASSERT_EQ(distance(half.path[i], all.path[i]), 0.0) << "pose " << i;
  }
}

}  // namespace
}  // namespace pf_resampling
