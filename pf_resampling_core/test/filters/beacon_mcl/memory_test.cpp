#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>
#include <thread>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/filters/beacon_mcl/beacon_mcl.hpp"
#include "pf_resampling_core/filters/beacon_mcl/saved_beacon_mcl.hpp"
#include "pf_resampling_core/test/range_memory/drive_among_radios.hpp"

namespace pf_resampling {
namespace {

BeaconMclOptions with_redraw() {
  BeaconMclOptions options;
  options.particles = 500;
  options.strategy.renewal = Renewal::redraw;
  return options;
}

double error_after(double duration, DriveAmongRadios* drive, BeaconMcl* filter) {
  drive->drive(duration, 21,
               [&](const OdometryIncrement& increment, const RangeObservation& range) {
                 filter->update(increment, {range});
               });
  const PoseEstimate estimate = filter->estimate();
  return std::hypot(estimate.mean.x - drive->truth.x, estimate.mean.y - drive->truth.y);
}

TEST(BeaconMclMemory, FindsAnAntennaThatNobodyTold) {
  DriveAmongRadios drive;
  drive.antenna = {0.5, 0.0, 0.0};
  BeaconMcl filter(with_redraw(), drive.beacons, 1);
  EXPECT_LT(error_after(180.0, &drive, &filter), 0.25);
  EXPECT_GT(filter.status().redraws, 10);
}

// Once it is drawn from the memory ranges weigh no particles.
TEST(BeaconMclMemory, IsDrawnSeveralTimesASecondFromTheFirstTimeOn) {
  DriveAmongRadios drive;
  BeaconMcl filter(with_redraw(), drive.beacons, 1);
  error_after(8.0, &drive, &filter);
  EXPECT_GT(filter.status().redraws, 5);
}

// Only a turn tells it from the pose.
TEST(BeaconMclMemory, AnAntennaThatNobodyToldIsPartOfTheCovarianceBeforeTheFirstTurn) {
  for (const double ahead : {0.5, -0.5}) {
    DriveAmongRadios drive;
    drive.straight = 6.0;
    drive.antenna = {ahead, 0.0, 0.0};
    BeaconMcl filter(with_redraw(), drive.beacons, 1);
    error_after(25.0, &drive, &filter);
    ASSERT_GT(filter.status().redraws, 10);
    const PoseEstimate estimate = filter.estimate();
    const Eigen::Vector2d off(estimate.mean.x - drive.truth.x, estimate.mean.y - drive.truth.y);
    const Eigen::Matrix2d covariance = estimate.covariance.topLeftCorner<2, 2>();
    EXPECT_LT(off.dot(covariance.inverse() * off), 9.0) << ahead;
  }
}

TEST(BeaconMclMemory, DoesWithoutTheBeaconThatIsElsewhere) {
  DriveAmongRadios drive;
  std::vector<Beacon> listed = drive.beacons;
  listed[2].position.x() += 3.0;
  BeaconMcl filter(with_redraw(), listed, 1);
  EXPECT_LT(error_after(120.0, &drive, &filter), 0.3);
  for (const Beacon& beacon : listed) EXPECT_EQ(filter.is_not_as_listed(beacon.id), beacon.id == 3);
}

// It has any heading until it moves, and least squares from a wrong one ends elsewhere. While two
// fit, both are drawn.
TEST(BeaconMclMemory, ARobotThatStoodIsNotPutElsewhereWhenItMoves) {
  for (const double heading : {0.0, 1.5, 3.0, -1.5}) {
    DriveAmongRadios drive;
    drive.truth = {0.0, 0.0, heading};
    BeaconMcl filter(with_redraw(), drive.beacons, 1);
    for (int i = 0; i < 200; ++i) {
      const Beacon& beacon = drive.beacons[static_cast<std::size_t>(i % 4)];
      OdometryIncrement rest;
      append(OdometryNoise{}, Pose2{}, 0.1, &rest);
      RangeObservation range;
      range.beacon = beacon.id;
      range.range = std::hypot(beacon.position.x(), beacon.position.y()) + 0.02 * (i % 7 - 3);
      filter.update(rest, {range});
    }
    drive.scale = 1.0;
    drive.bias = 0.0;
    for (int part = 0; part < 6; ++part) {
      const double error = error_after(3.0, &drive, &filter);
      const Eigen::Matrix3d covariance = filter.estimate().covariance;
      EXPECT_LT(error, std::max(1.5, 2.0 * std::sqrt(covariance.topLeftCorner<2, 2>().trace())))
          << heading << " " << part;
    }
  }
}

// What was known before says nothing of where the robot is now.
TEST(BeaconMclMemory, BeginsAnewWhereTheRobotIsPut) {
  DriveAmongRadios drive;
  BeaconMcl filter(with_redraw(), drive.beacons, 1);
  error_after(60.0, &drive, &filter);
  ASSERT_FALSE(filter.memory()->modes().empty());
  filter.initialize_gaussian(drive.truth, 0.01 * Eigen::Matrix3d::Identity());
  EXPECT_TRUE(filter.memory()->modes().empty());
}

TEST(BeaconMclMemory, ASavedOneGoesOnToTheBit) {
  DriveAmongRadios drive;
  drive.antenna = {0.5, 0.0, 0.0};
  std::vector<Beacon> listed = drive.beacons;
  listed[2].position.x() += 3.0;
  BeaconMcl whole(with_redraw(), listed, 1);
  BeaconMcl second(with_redraw(), listed, 1);
  const std::string path = testing::TempDir() + "beacon_mcl_memory.checkpoint";
  for (const double until : {7.0, 3.0, 70.0}) {
    error_after(until, &drive, &whole);
    write_saved(kCheckpointFile, path, whole.saved());
    second.load(read_saved<SavedBeaconMcl>(kCheckpointFile, path));
    drive.drive(20.0, 22, [&](const OdometryIncrement& increment, const RangeObservation& range) {
      whole.update(increment, {range});
      second.update(increment, {range});
    });
    EXPECT_TRUE((whole.particles().x == second.particles().x).all()) << until;
    EXPECT_TRUE((whole.particles().scale == second.particles().scale).all());
    EXPECT_EQ(whole.memory()->time(), second.memory()->time());
  }
  EXPECT_TRUE(second.is_not_as_listed(3));
  EXPECT_GT(second.status().redraws, 2);
  std::remove(path.c_str());
}

// Without a memory in the checkpoint, or for it, the particles are what goes on.
TEST(BeaconMclMemory, IsNoPartOfAFilterThatResamples) {
  DriveAmongRadios drive;
  BeaconMcl redraws(with_redraw(), drive.beacons, 1);
  error_after(30.0, &drive, &redraws);
  BeaconMclOptions options = with_redraw();
  options.strategy.renewal = Renewal::resampling;
  BeaconMcl resamples(options, drive.beacons, 1);
  resamples.load(redraws.saved());
  EXPECT_EQ(resamples.memory(), nullptr);
  redraws.load(resamples.saved());
  EXPECT_TRUE(redraws.memory()->modes().empty());
}

TEST(BeaconMclMemory, BeginsAndEndsWhileTheFilterRuns) {
  DriveAmongRadios drive;
  drive.antenna = {0.5, 0.0, 0.0};
  BeaconMclOptions options = with_redraw();
  options.strategy.renewal = Renewal::resampling;
  BeaconMcl filter(options, drive.beacons, 1);
  error_after(30.0, &drive, &filter);
  filter.set_options(with_redraw());
  EXPECT_LT(error_after(150.0, &drive, &filter), 0.25);
  EXPECT_GT(filter.status().redraws, 10);
  filter.set_options(options);
  EXPECT_EQ(filter.memory(), nullptr);
  EXPECT_FALSE(filter.is_not_as_listed(1));
  EXPECT_LT(error_after(10.0, &drive, &filter), 1.0);
}

// In a thread beside it: the updates go on, and what they bring is not lost.
TEST(BeaconMclMemory, ASolutionThatIsDeferredKeepsWhatComesMeanwhile) {
  DriveAmongRadios drive;
  drive.antenna = {0.5, 0.0, 0.0};
  BeaconMcl filter(with_redraw(), drive.beacons, 1);
  TakeOvers take_overs;
  filter.set_deferred_solutions(&take_overs);
  int ranges = 0;
  drive.drive(180.0, 21, [&](const OdometryIncrement& increment, const RangeObservation& range) {
    filter.update(increment, {range});
    ++ranges;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  int held = 0;
  for (const auto& of_keyframe : filter.memory()->graph().ranges) {
    held += static_cast<int>(of_keyframe.size());
  }
  EXPECT_EQ(held, ranges);
  EXPECT_NEAR(filter.memory()->time(), 180.0, 1e-6);
  EXPECT_GT(filter.status().redraws, 10);
  const PoseEstimate estimate = filter.estimate();
  EXPECT_LT(std::hypot(estimate.mean.x - drive.truth.x, estimate.mean.y - drive.truth.y), 0.25);
}

// It is of a robot that was elsewhere.
TEST(BeaconMclMemory, ADeferredSolutionOfAFilterThatWasPutElsewhereIsOfNoUse) {
  DriveAmongRadios drive;
  BeaconMcl filter(with_redraw(), drive.beacons, 1);
  error_after(60.0, &drive, &filter);
  TakeOvers take_overs;
  filter.set_deferred_solutions(&take_overs);
  error_after(30.0, &drive, &filter);
  filter.initialize_gaussian(drive.truth, 0.01 * Eigen::Matrix3d::Identity());
  error_after(0.2, &drive, &filter);
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  error_after(4.0, &drive, &filter);
  EXPECT_LT(filter.memory()->time(), 5.0);
}

BeaconMclOptions that_finds() {
  BeaconMclOptions options = with_redraw();
  options.beacon_positions = BeaconPositions::estimated;
  return options;
}

/// m, from where the robot is, in the frame of `origin`.
double error_from(const Pose2& origin, double duration, DriveAmongRadios* drive,
                  BeaconMcl* filter) {
  error_after(duration, drive, filter);
  const Pose2 believed = compose(origin, filter->estimate().mean);
  return std::hypot(believed.x - drive->truth.x, believed.y - drive->truth.y);
}

// In the frame of the first pose.
TEST(BeaconMclMemory, FindsBeaconsThatNobodyListed) {
  DriveAmongRadios drive;
  const Pose2 start = drive.truth;
  BeaconMcl filter(that_finds(), {}, 1);
  EXPECT_LT(error_from(start, 180.0, &drive, &filter), 0.3);
  const std::vector<Beacon> found = filter.found_beacons();
  ASSERT_EQ(found.size(), drive.beacons.size());
  for (std::size_t b = 0; b < found.size(); ++b) {
    const Pose2 place = compose(start, {found[b].position.x(), found[b].position.y(), 0.0});
    EXPECT_EQ(found[b].id, drive.beacons[b].id);
    EXPECT_LT(std::hypot(place.x - drive.beacons[b].position.x(),
                         place.y - drive.beacons[b].position.y()),
              0.5);
    EXPECT_GT(found[b].sigma, 0.0);
    EXPECT_LT(found[b].sigma, 0.5);
  }
  EXPECT_EQ(filter.calibration().size(), 4U);
  EXPECT_LT(std::abs(filter.status().innovation), 4.0 * filter.status().innovation_sigma);
}

TEST(BeaconMclMemory, FindsOthersInTheFrameOfThoseThatAreListed) {
  DriveAmongRadios drive;
  const std::vector<Beacon> listed = {drive.beacons.begin(), drive.beacons.begin() + 2};
  BeaconMcl filter(that_finds(), listed, 1);
  EXPECT_LT(error_after(120.0, &drive, &filter), 0.3);
  const std::vector<Beacon> found = filter.found_beacons();
  ASSERT_EQ(found.size(), 4U);
  for (std::size_t b = 0; b < 4; ++b) {
    EXPECT_LT((found[b].position - drive.beacons[b].position).norm(), 0.5) << b;
  }
}

// What was found stays, in the frame that the pose says.
TEST(BeaconMclMemory, KnowsWhatItFoundWhereTheRobotIsPut) {
  DriveAmongRadios drive;
  const Pose2 start = drive.truth;
  BeaconMcl filter(that_finds(), {}, 1);
  error_after(120.0, &drive, &filter);
  const Pose2 elsewhere = {5.0, 3.0, 2.0};
  drive.truth = elsewhere;
  filter.initialize_gaussian(relative(start, elsewhere), 0.04 * Eigen::Matrix3d::Identity());
  EXPECT_EQ(filter.found_beacons().size(), 4U);
  EXPECT_LT(error_from(start, 5.0, &drive, &filter), 0.5);
}

TEST(BeaconMclMemory, FindsTheRobotAmongWhatItFound) {
  DriveAmongRadios drive;
  const Pose2 start = drive.truth;
  BeaconMcl filter(that_finds(), {}, 1);
  error_after(120.0, &drive, &filter);
  drive.truth = {5.0, 3.0, 2.0};
  filter.global_localization();
  EXPECT_FALSE(filter.is_initialized());
  EXPECT_LT(error_from(start, 20.0, &drive, &filter), 0.5);
}

TEST(BeaconMclMemory, ASavedOneGoesOnAmongWhatItFound) {
  DriveAmongRadios drive;
  BeaconMcl whole(that_finds(), {}, 1);
  BeaconMcl second(that_finds(), {}, 1);
  const std::string path = testing::TempDir() + "found_beacons.checkpoint";
  error_after(60.0, &drive, &whole);
  whole.initialize_gaussian(whole.estimate().mean, 0.04 * Eigen::Matrix3d::Identity());
  error_after(20.0, &drive, &whole);
  write_saved(kCheckpointFile, path, whole.saved());
  second.load(read_saved<SavedBeaconMcl>(kCheckpointFile, path));
  drive.drive(20.0, 22, [&](const OdometryIncrement& increment, const RangeObservation& range) {
    whole.update(increment, {range});
    second.update(increment, {range});
  });
  EXPECT_TRUE((whole.particles().x == second.particles().x).all());
  EXPECT_EQ(whole.found_beacons().size(), second.found_beacons().size());
  EXPECT_THROW(BeaconMcl(with_redraw(), drive.beacons, 1).load(whole.saved()), Error);
  std::remove(path.c_str());
}

TEST(BeaconMclMemory, ItsNumberOfParticlesMayChangeWhereBeaconsAreFound) {
  DriveAmongRadios drive;
  BeaconMcl filter(that_finds(), {}, 1);
  error_after(5.0, &drive, &filter);
  BeaconMclOptions options = that_finds();
  options.particles = 700;
  filter.set_options(options);
  error_after(5.0, &drive, &filter);
  EXPECT_EQ(filter.particles().size(), 700);
  options.beacon_positions = BeaconPositions::known;
  EXPECT_THROW(filter.set_options(options), Error);
}

TEST(BeaconMclMemory, IsThereForRedrawAlone) {
  const DriveAmongRadios drive;
  EXPECT_EQ(BeaconMcl({}, drive.beacons, 1).memory(), nullptr);
}

}  // namespace
}  // namespace pf_resampling
