#include "pf_resampling_core/range_memory/range_memory.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/range_memory/drive_among_radios.hpp"

namespace pf_resampling {
namespace {

using Common = CommonUnknown;

const RadioKnowledge& radio_of(const std::vector<RadioKnowledge>& radios, int id) {
  for (const RadioKnowledge& radio : radios) {
    if (radio.id == id) return radio;
  }
  throw Error("no such radio");
}

/// Of an error in standard deviations: beyond 5 one time in two million.
void expect_near(double value, double truth, double sigma, const char* what) {
  EXPECT_LT(std::abs(value - truth), 5.0 * sigma) << what << " " << value << " ± " << sigma;
}

TEST(RangeMemory, FindsPoseCalibrationWheelsAndAntenna) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    DriveAmongRadios drive;
    drive.distance_scale = 1.03;
    drive.antenna = {0.4, -0.1};
    RangeMemory memory({}, drive.beacons);
    drive.drive(240.0, seed, &memory);
    ASSERT_EQ(memory.modes().size(), 1U);
    EXPECT_LT(drive.error(memory), 0.2) << "seed " << seed;
    const RangeMemory::Newest newest = memory.newest(memory.modes().front());
    const auto expect_constant = [&](int index, double truth, double largest, const char* what) {
      const int at = KeyframeUnknown::count + index;
      const double sigma = std::sqrt(newest.covariance(at, at));
      EXPECT_LT(sigma, largest) << what;
      expect_near(newest.mean[at], truth, sigma, what);
    };
    expect_constant(Common::distance_scale, 0.03, 0.02, "wheels");
    expect_constant(Common::lever_x, 0.4, 0.04, "lever x");
    expect_constant(Common::lever_y, -0.1, 0.04, "lever y");
    for (const RadioKnowledge& radio : memory.radios()) {
      EXPECT_EQ(radio.account, RadioAccount::as_listed) << "radio " << radio.id;
    }
  }
}

// Were each of them free from the start, the poses of a drive without them would be half as good.
TEST(RangeMemory, TakesErrorsForSmallUntilTheDataSayOtherwise) {
  const auto loose_after = [](DriveAmongRadios drive) {
    RangeMemory memory({}, drive.beacons);
    drive.drive(120.0, 3, &memory);
    EXPECT_LT(drive.error(memory), 0.15);
    return memory.modes().front().loose;
  };
  EXPECT_EQ(loose_after({}), LooseErrors{});
  DriveAmongRadios ahead;
  ahead.antenna = {0.4, 0.0};
  EXPECT_TRUE(loose_after(ahead)[LooseError::antenna]);
  DriveAmongRadios long_wheels;
  long_wheels.distance_scale = 1.04;
  EXPECT_TRUE(loose_after(long_wheels)[LooseError::wheels]);
}

TEST(RangeMemory, NamesTheRadioThatIsElsewhere) {
  for (const double off : {1.5, 2.0, 5.0}) {
    DriveAmongRadios drive;
    std::vector<Beacon> listed = drive.beacons;
    listed[2].position.x() += off;
    RangeMemory memory({}, listed);
    drive.drive(120.0, 4, &memory);
    const std::vector<RadioKnowledge> radios = memory.radios();
    for (const RadioKnowledge& radio : radios) {
      EXPECT_EQ(radio.account == RadioAccount::as_listed, radio.id != 3)
          << "radio " << radio.id << ", off by " << off;
    }
    ASSERT_EQ(radio_of(radios, 3).places.size(), 1U);
    EXPECT_LT((radio_of(radios, 3).places[0].position - drive.beacons[2].position.head<2>()).norm(),
              0.25);
    EXPECT_LT(drive.error(memory), 0.2);
  }
}

TEST(RangeMemory, NamesTheRadioThatIsBiased) {
  DriveAmongRadios drive;
  drive.biased = 1.0;
  RangeMemory memory({}, drive.beacons);
  drive.drive(120.0, 5, &memory);
  const std::vector<RadioKnowledge> radios = memory.radios();
  for (const RadioKnowledge& radio : radios) {
    EXPECT_EQ(radio.account == RadioAccount::as_listed, radio.id != 4) << "radio " << radio.id;
  }
  EXPECT_EQ(radio_of(radios, 4).account, RadioAccount::biased);
  EXPECT_NEAR(radio_of(radios, 4).calibration.bias, 1.1, 0.3);
}

TEST(RangeMemory, NamesTheRadioThatRepeatsAnother) {
  DriveAmongRadios drive;
  drive.radio_that_repeats = 2;
  RangeMemory memory({}, drive.beacons);
  drive.drive(120.0, 6, &memory);
  const std::vector<RadioKnowledge> radios = memory.radios();
  EXPECT_EQ(radio_of(radios, 3).account, RadioAccount::elsewhere);
  EXPECT_EQ(radio_of(radios, 3).in_place_of, 1);
  EXPECT_EQ(radio_of(radios, 1).account, RadioAccount::as_listed);
}

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

// Before a turn each of them may be on either side.
TEST(RangeMemory, ShowsBothSidesBeforeTheFirstTurn) {
  DriveAmongRadios drive;
  drive.straight = 20.0;
  drive.truth = {-22.0, -2.0, 0.0};
  RangeMemory memory({}, {});
  drive.drive(60.0, 10, &memory);
  for (const RadioKnowledge& radio : memory.radios()) {
    ASSERT_EQ(radio.places.size(), 2U) << "radio " << radio.id;
    EXPECT_NEAR(radio.places[0].position.y(), -radio.places[1].position.y(), 1.0);
  }
}

TEST(RangeMemory, WithTwoRadiosTheRobotMayBeOnEitherSideUntilItTurns) {
  DriveAmongRadios drive;
  drive.straight = 20.0;
  drive.truth = {-22.0, -2.0, 0.0};
  drive.beacons.resize(2);
  RangeMemory memory({}, drive.beacons);
  drive.drive(40.0, 11, &memory);
  ASSERT_EQ(memory.modes().size(), 2U);
  drive.drive(160.0, 12, &memory);
  ASSERT_EQ(memory.modes().size(), 1U);
  EXPECT_LT(drive.error(memory), 0.4);
}

TEST(RangeMemory, BeaconsWithOneIdAreToldOf) {
  DriveAmongRadios drive;
  drive.beacons[1].id = 1;
  EXPECT_THROW(RangeMemory({}, drive.beacons), Error);
}

}  // namespace
}  // namespace pf_resampling
