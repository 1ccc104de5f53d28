#include "tools/common/batch_slam.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pf_resampling_core/error.hpp"
#include "test/batch_testing.hpp"
#include "tools/worlds/world_file.hpp"

namespace pf_resampling {
namespace {

/// The reference world with odometry that reads too much, and no noise at all.
World exact_world() {
  World world = load_world("indoor_two_loops");
  world.odometry.speed_sigma = world.odometry.yaw_rate_sigma = 0.0;
  world.odometry.distance_scale = 1.05;
  world.odometry.yaw_scale = 1.08;
  world.landmark_sensor.range_sigma = world.landmark_sensor.bearing_sigma = 0.0;
  return world;
}

TEST(SolveBatch, FindsPathMapAndScalesOfExactData) {
  const KnownDrive recording = drive_through(exact_world(), 1);
  const BatchSolution solution = solve_batch(recording);
  EXPECT_NEAR(solution.distance_scale, 1.05, 0.002);
  EXPECT_NEAR(solution.yaw_scale, 1.08, 0.002);
  EXPECT_EQ(solution.outliers, 0);
  ASSERT_EQ(solution.path.size(), recording.odometry.size());
  // The start of the world is the origin of the solution, so nothing has to be aligned.
  for (std::size_t i = 0; i < solution.path.size(); ++i) {
    const Pose2& truth = recording.truth[i].pose;
    EXPECT_NEAR(solution.path[i].pose.x, truth.x, 0.02);
    EXPECT_NEAR(solution.path[i].pose.y, truth.y, 0.02);
    EXPECT_NEAR(wrap_angle(solution.path[i].pose.heading - truth.heading), 0.0, 0.01);
  }
  EXPECT_EQ(solution.landmarks.size(), 30U);
  EXPECT_LT(map_error(solution.landmarks, recording.landmarks), 0.01);
}

TEST(SolveBatch, MisreadIdsHardlyPull) {
  KnownDrive recording = drive_through(exact_world(), 1);
  int misread = 0;
  int count = 0;
  for (StampedScan& scan : recording.scans) {
    for (RangeBearingObservation& seen : scan.landmarks) {
      if (count++ % 23 != 7) continue;
      seen.id = (seen.id + 11) % 30;
      ++misread;
    }
  }
  const BatchSolution solution = solve_batch(recording);
  EXPECT_EQ(solution.outliers, misread);
  EXPECT_LT(map_error(solution.landmarks, recording.landmarks), 0.05);
}

TEST(SolveBatch, SensorsSitAnywhereOnTheRobot) {
  KnownDrive recording = drive_through(exact_world(), 1);
  const Pose2 mount = {0.4, -0.3, 1.2};
  for (StampedScan& scan : recording.scans) {
    scan.sensor = mount;
    for (RangeBearingObservation& seen : scan.landmarks) {
      const Pose2 point = relative(
          mount, {seen.range * std::cos(seen.bearing), seen.range * std::sin(seen.bearing), 0.0});
      seen.range = std::hypot(point.x, point.y);
      seen.bearing = std::atan2(point.y, point.x);
    }
  }
  EXPECT_LT(map_error(solve_batch(recording).landmarks, recording.landmarks), 0.01);
}

TEST(SolveBatch, ReachesTheBoundOfTheReferenceWorld) {
  // DATASETS.md: map RMS at the end 0.173 m. Over 25 seeds, with a standard deviation from seed to
  // seed of 0.08 m: a standard error of 0.016 m; 5 of them.
  const World world = load_world("indoor_two_loops");
  BatchNoise noise;
  noise.distance_scale = noise.yaw_scale = 1e-4;  // the world's are 1
  double sum = 0.0;
  constexpr int kSeeds = 25;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const KnownDrive recording = drive_through(world, static_cast<std::uint64_t>(seed));
    sum += map_error(solve_batch(recording, noise).landmarks, recording.landmarks);
  }
  EXPECT_NEAR(sum / kSeeds, 0.173, 0.08);
}

// The reference world as it is, to `end` (s).
KnownDrive noisy_problem(double end) {
  KnownDrive recording = drive_through(load_world("indoor_two_loops"), 3);
  cut(end, &recording.odometry);
  cut(end, &recording.scans);
  return recording;
}

TEST(SolveOnline, KnowsThePastOnly) {
  const KnownDrive whole = noisy_problem(1e9);
  const double half_time = whole.odometry[whole.odometry.size() / 2].time;
  const OnlineSolution all = solve_online(whole);
  const OnlineSolution half = solve_online(noisy_problem(half_time));
  ASSERT_EQ(all.path.size(), whole.odometry.size());
  const auto sees = [](const StampedScan& scan) { return !scan.landmarks.empty(); };
  ASSERT_EQ(all.solutions, std::count_if(whole.scans.begin(), whole.scans.end(), sees));
  ASSERT_GT(half.solutions, 20);
  for (std::size_t i = 0; i < half.path.size(); ++i) {
    ASSERT_EQ(half.path[i].time, all.path[i].time);
    ASSERT_EQ(distance(half.path[i], all.path[i]), 0.0) << "pose " << i;
  }
}

// Then it knows what the whole problem knows.
TEST(SolveOnline, EndsWhereTheBatchSolutionEnds) {
  const KnownDrive problem = noisy_problem(1e9);
  const OnlineSolution online = solve_online(problem);
  EXPECT_EQ(online.refused, 0);
  // Both stop within a hundredth of a standard deviation, which is a decimetre.
  EXPECT_LT(distance(online.path.back(), solve_batch(problem).path.back()), 2e-3);
}

// The robot stands for an hour, say, and its odometry is silent.
TEST(SolveBatch, AnHourWithoutOdometryIsBridged) {
  KnownDrive problem = drive_through(exact_world(), 1);
  const double middle = 0.5 * problem.odometry.back().time;
  set_clock(middle, 3600.0, &problem.odometry);
  set_clock(middle, 3600.0, &problem.scans);
  const BatchSolution solution = solve_batch(problem);
  EXPECT_EQ(solution.path.size(), problem.odometry.size());
  EXPECT_EQ(solution.outliers, 0);
}

TEST(SolveBatch, RefusesWhatMemoryCannotHold) {
  const RangeBearingObservation seen = {1, 3.0, 0.0, 0.0, 0.0};
  Recording recording;
  recording.odometry = {{0.0, {}}, {51000.0, {}}};
  recording.scans = {{0.0, {}, {seen}}};
  EXPECT_TRUE(says(refusal([&] { solve_batch(recording); }), "102001 poses"));
  recording.odometry.back().time = 10.0;
  recording.scans[0].landmarks.resize(6000, seen);
  EXPECT_EQ(solve_batch(recording).landmarks.size(), 1U);
  for (int i = 0; i < 6000; ++i) recording.scans[0].landmarks[static_cast<std::size_t>(i)].id = i;
  EXPECT_TRUE(says(refusal([&] { solve_batch(recording); }), "6000 landmarks"));
}

TEST(SolveBatch, NeedsIdsAndOdometry) {
  KnownDrive recording = drive_through(exact_world(), 1);
  for (StampedScan& scan : recording.scans) {
    for (RangeBearingObservation& seen : scan.landmarks) seen.id = -1;
  }
  EXPECT_THROW(solve_batch(recording), Error);
  EXPECT_THROW(solve_online(recording), Error);
  EXPECT_THROW(solve_batch({}), Error);
  EXPECT_THROW(solve_online({}), Error);
}

}  // namespace
}  // namespace pf_resampling
