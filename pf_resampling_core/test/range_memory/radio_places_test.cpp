#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "pf_resampling_core/range_memory/range_memory.hpp"
#include "pf_resampling_core/test/range_memory/drive_among_radios.hpp"

namespace pf_resampling {
namespace {

TEST(RangeMemory, FindsRadiosThatNobodyListed) {
  for (const unsigned seed : {7U, 8U, 9U}) {
    DriveAmongRadios drive;
    const Pose2 start = drive.truth;
    RangeMemory memory({}, {});
    drive.drive(180.0, seed, &memory);
    const std::vector<RadioKnowledge> radios = memory.radios();
    ASSERT_EQ(radios.size(), 4U);
    for (const Beacon& beacon : drive.beacons) {
      const RadioKnowledge& radio = radio_of(radios, beacon.id);
      EXPECT_EQ(radio.account, RadioAccount::unlisted);
      ASSERT_EQ(radio.places.size(), 1U);
      // The frame is that of the first pose.
      const Pose2 place =
          relative(start, {beacon.position.x(), beacon.position.y(), start.heading});
      EXPECT_LT((radio.places[0].position - Eigen::Vector2d(place.x, place.y)).norm(), 0.6)
          << "radio " << beacon.id << ", seed " << seed;
    }
  }
}

// How far the first pose was from them, and where it looked, is of no account.
TEST(RangeMemory, IsAsSureOfRadiosFarFromTheStart) {
  const auto largest_sigma_from = [](const Pose2& first) {
    DriveAmongRadios drive;
    PoseEstimate start;
    start.mean = first;
    RangeMemory memory({}, {}, {}, start);
    drive.drive(180.0, 7, &memory);
    double largest = 0.0;
    EXPECT_EQ(memory.found().size(), 4U);
    for (const Beacon& beacon : memory.found()) largest = std::max(largest, beacon.sigma);
    return largest;
  };
  const double near = largest_sigma_from({0.0, 0.0, 0.0});
  EXPECT_LT(near, 0.2);
  EXPECT_NEAR(largest_sigma_from({1000.0, -500.0, 2.0}), near, 0.02);
}

// Nothing else says how long it is: poses and places are all a little farther apart, or nearer.
TEST(RangeMemory, AMetreIsOneOfTheOdometryWhereNobodyListsBeacons) {
  DriveAmongRadios drive;
  drive.distance_scale = 1.04;
  const Pose2 start = drive.truth;
  RangeMemory memory({}, {});
  drive.drive(180.0, 7, &memory);
  const auto expect_consistent = [&](Eigen::Vector2d there, const Eigen::Vector2d& true_place,
                                     const Eigen::Matrix2d& covariance) {
    const Pose2 place = relative(start, {true_place.x(), true_place.y(), start.heading});
    there -= Eigen::Vector2d(place.x, place.y);
    EXPECT_GT(there.norm(), 0.2);
    EXPECT_LT(there.dot(covariance.inverse() * there), 9.0);
  };
  const RangeMemory::Newest newest = memory.newest(memory.modes().front());
  expect_consistent(newest.mean.head<2>(), {drive.truth.x, drive.truth.y},
                    newest.covariance.topLeftCorner<2, 2>());
  const RadioPlace farthest = radio_of(memory.radios(), 3).places.front();
  expect_consistent(farthest.position, drive.beacons[2].position.head<2>(), farthest.covariance);
}

// The gyro drifts while it stands, by so much that nobody knows where ahead was.
TEST(RangeMemory, TheFrameBeginsWhereTheRobotDrivesOff) {
  const auto sigma_of_place = [](double standing) {
    DriveAmongRadios drive;
    RangeMemory memory({}, {});
    for (double time = 0.0; time < standing; time += 0.1) {
      OdometryIncrement increment;
      append(OdometryNoise{}, {0.0, 0.0, 7e-4}, 0.1, &increment);
      RangeObservation range;
      range.beacon = 1;
      range.range = 4.0;
      memory.add(increment, {range});
    }
    drive.yaw_rate_bias = 7e-3;
    drive.drive(60.0, 7, &memory);
    return std::sqrt(radio_of(memory.radios(), 3).places.front().covariance.trace());
  };
  EXPECT_NEAR(sigma_of_place(30.0), sigma_of_place(0.0), 0.05);
}

// One at a place that is hardly known makes the others no worse.
TEST(RangeMemory, FindsOthersBesideOneThatIsHardlyKnown) {
  DriveAmongRadios drive;
  RangeMemory memory({}, {});
  drive.drive(120.0, 7, &memory);
  const std::size_t before = memory.found().size();
  drive.beacons.back().id = 9;
  drive.beacons.back().position = {60.0, 40.0, 0.0};
  drive.drive(16.0, 8, &memory);
  EXPECT_GE(memory.found().size(), before);
}

// Before a turn each of them may be on either side, however many ranges are wild.
TEST(RangeMemory, ShowsBothSidesBeforeTheFirstTurn) {
  for (const double wild : {0.0, 0.2}) {
    DriveAmongRadios drive;
    drive.straight = 20.0;
    drive.truth = {-22.0, -2.0, 0.0};
    drive.wild = wild;
    RangeMemoryOptions options;
    options.sigma = drive.sigma;
    RangeMemory memory(options, {});
    drive.drive(1.0, 9, &memory);
    memory.solve();  // nothing is found yet, and nothing contradicts that
    drive.drive(45.0, 10, &memory);
    EXPECT_EQ(memory.modes().front().estimate.takes_part, std::vector<bool>(4, true)) << wild;
    for (const RadioKnowledge& radio : memory.radios()) {
      ASSERT_EQ(radio.places.size(), 2U) << "radio " << radio.id << ", wild " << wild;
      EXPECT_NEAR(radio.places[0].position.y(), -radio.places[1].position.y(), 2.0);
    }
    EXPECT_TRUE(memory.is_ambiguous());
    EXPECT_TRUE(memory.found().empty());
    drive.drive(160.0, 11, &memory);
    EXPECT_FALSE(memory.is_ambiguous());
    EXPECT_EQ(memory.found().size(), 4U);
  }
}

}  // namespace
}  // namespace pf_resampling
