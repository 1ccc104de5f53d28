#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "pf_resampling_core/range_memory/range_memory.hpp"
#include "pf_resampling_core/test/range_memory/drive_among_radios.hpp"

namespace pf_resampling {
namespace {

using Common = CommonUnknown;

// Wheels counted four times, a gyro with the wrong sign: no radio is accused. What turns show may
// come late.
TEST(RadioFaults, FindsOdometryThatCountsSeveralTimesOrTurnsTheWrongWay) {
  struct Odometry {
    double distance, turn, straight;
  };
  for (const auto& [distance, turn, straight] :
       {Odometry{4.0, 1.0, 0.0}, Odometry{0.25, 1.0, 0.0}, Odometry{1.0, 3.0, 0.0},
        Odometry{1.0, -1.0, 0.0}, Odometry{1.0, -1.0, 12.0}}) {
    DriveAmongRadios drive;
    drive.distance_scale = distance;
    drive.turn_scale = turn;
    drive.straight = straight;
    drive.truth.x -= 0.5 * straight;
    // Where it began is not where it is when the data begin anew.
    PoseEstimate first;
    first.mean = drive.truth;
    first.covariance = 1e-4 * Eigen::Matrix3d::Identity();
    RangeMemory memory({}, drive.beacons, {}, first);
    drive.drive(60.0 + 4.0 * straight, 3, &memory);
    const RangeMode& mode = memory.modes().front();
    const OdometryFactors& factors = memory.odometry_factors();
    const auto scale = [&](Common::Index of) { return 1.0 + mode.estimate.constants[of]; };
    EXPECT_NEAR(factors.distance * scale(Common::distance_scale), distance, 0.05 * distance);
    EXPECT_NEAR(factors.turn * scale(Common::turn_scale), turn, 0.05 * std::abs(turn));
    EXPECT_EQ(mode.accounts, std::vector<RadioAccount>(4, RadioAccount::as_listed));
    EXPECT_LT(drive.error(memory), 0.3) << distance << ", " << turn << ", " << straight;
  }
}

// On a straight lane noise of the ranges explains wheels that count a quarter, too.
TEST(RadioFaults, FindsWheelsThatCountAQuarterOnAStraightLane) {
  for (const unsigned seed : {4U, 5U, 6U}) {
    DriveAmongRadios drive;
    drive.distance_scale = 0.25;
    drive.straight = 10.0;
    drive.truth = {-13.0, -8.0, 0.0};
    for (Beacon& beacon : drive.beacons) beacon.position.head<2>() *= 1.5;
    RangeMemory memory({}, drive.beacons);
    int steps = 0;
    drive.drive(100.0, seed, [&](const OdometryIncrement& motion, const RangeObservation& range) {
      memory.add(motion, std::vector<RangeObservation>(++steps % 3 == 0 ? 1 : 0, range));
      if (steps % 10 == 0) memory.solve();
    });
    EXPECT_LT(drive.error(memory), 0.5) << seed;
  }
}

// From two that are swapped, single steps lead to paths that are mirrored, with others accused.
// Until it turns, a mirrored robot may be right; and one that is turned by half a turn, but for
// heights.
TEST(RadioFaults, NamesTwoThatAreSwappedAtOnce) {
  for (const bool have_heights : {false, true}) {
    for (const auto& [a, b] : {std::pair(0, 1), std::pair(1, 2), std::pair(0, 2)}) {
      if (b == a + 2 && !have_heights) continue;
      DriveAmongRadios drive;
      if (have_heights) {
        drive.straight = 14.0;
        drive.truth.x = -12.0;
        drive.antenna.z() = 0.5;
        for (std::size_t i = 0; i < 4; ++i) {
          drive.beacons[i].position.z() = std::array{2.0, 3.5, 1.0, 2.0}[i];
          drive.beacons[i].is_planar = false;
        }
      }
      std::vector<Beacon> listed = drive.beacons;
      std::swap(listed[static_cast<std::size_t>(a)].position,
                listed[static_cast<std::size_t>(b)].position);
      RangeMemory memory({}, listed);
      drive.drive(have_heights ? 90.0 : 60.0, 3, &memory);
      EXPECT_LT(drive.error(memory), have_heights ? 0.15 : 0.3) << a << b;
      for (const RadioKnowledge& radio : memory.radios()) {
        const bool is_swapped = radio.id == a + 1 || radio.id == b + 1;
        EXPECT_EQ(radio.account, is_swapped ? RadioAccount::elsewhere : RadioAccount::as_listed)
            << a << b << " " << radio.id;
        EXPECT_EQ(radio.in_place_of, is_swapped ? a + b + 2 - radio.id : -1);
      }
    }
  }
}

// Two that are swapped, and a robot that turns at once: others explain a few ranges as well.
TEST(RadioFaults, NamesNobodyAfterAFewRanges) {
  std::mt19937 engine(4);
  std::normal_distribution<double> normal;
  const DriveAmongRadios drive;
  std::vector<Beacon> listed = drive.beacons;
  std::swap(listed[0].position, listed[2].position);
  RangeMemory memory({}, listed);
  Pose2 truth = {-3.0, 2.0, 1.2};
  for (int i = 0; i < 100; ++i) {
    const Pose2 motion = {0.05, 0.0, 0.04};
    truth = compose(truth, motion);
    OdometryIncrement increment;
    append(OdometryNoise{}, motion, 0.1, &increment);
    const Beacon& heard = drive.beacons[static_cast<std::size_t>(i % 4)];
    RangeObservation range;
    range.beacon = heard.id;
    range.range = std::hypot(heard.position.x() - truth.x, heard.position.y() - truth.y) +
                  0.1 * normal(engine);
    range.variance = 0.01;
    memory.add(increment, {range});
    if (i % 3 == 0) memory.solve();
    const std::vector<RadioKnowledge> radios = memory.radios();
    for (const RadioKnowledge& radio : radios) {
      ASSERT_EQ(radio.account, RadioAccount::as_listed) << "radio " << radio.id << ", range " << i;
    }
  }
}

TEST(RadioFaults, NamesTheRadioThatIsElsewhere) {
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

// From where the drive begins it looks like one with a bias, and later others would be accused.
TEST(RadioFaults, TakesARadioWithABiasForOneElsewhereOnceTheDataSaySo) {
  DriveAmongRadios drive;
  std::vector<Beacon> listed = drive.beacons;
  listed[0].position.head<2>() += Eigen::Vector2d(2.5, 2.5);
  RangeMemory memory({}, listed);
  int steps = 0;
  drive.drive(90.0, 1, [&](const OdometryIncrement& odometry, const RangeObservation& range) {
    memory.add(odometry, {range});
    if (++steps % 10 == 0) memory.solve();
  });
  for (const RadioKnowledge& radio : memory.radios()) {
    EXPECT_EQ(radio.account, radio.id == 1 ? RadioAccount::elsewhere : RadioAccount::as_listed)
        << "radio " << radio.id;
  }
  EXPECT_LT(drive.error(memory), 0.2);
}

// Before it, a mirrored path makes another radio as likely to be wrong.
TEST(RadioFaults, NamesNoRadioBeforeTheFirstTurn) {
  const auto named_after = [](double duration) {
    DriveAmongRadios drive;
    drive.straight = 20.0;
    drive.truth = {-22.0, -2.0, 0.0};
    std::vector<Beacon> listed = drive.beacons;
    listed[2].position.x() += 3.0;
    RangeMemory memory({}, listed);
    drive.drive(duration, 4, &memory);
    std::vector<int> named;
    for (const RadioKnowledge& radio : memory.radios()) {
      if (radio.account != RadioAccount::as_listed) named.push_back(radio.id);
    }
    return named;
  };
  EXPECT_EQ(named_after(60.0), std::vector<int>{});
  EXPECT_EQ(named_after(120.0), std::vector<int>{3});
}

TEST(RadioFaults, NamesTheRadioThatIsBiased) {
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

// Ranges of minutes before would outvote those since for as long again.
TEST(RadioFaults, ARadioThatChangesIsNamedSoonAndClearedSoon) {
  DriveAmongRadios drive;
  RangeMemory memory({}, drive.beacons);
  const auto account_after = [&](double duration, double bias) {
    drive.biased = bias;
    drive.drive(duration, 6, &memory);
    for (int id = 1; id <= 3; ++id) {
      EXPECT_EQ(radio_of(memory.radios(), id).account, RadioAccount::as_listed) << "radio " << id;
    }
    EXPECT_LT(drive.error(memory), 0.2);
    return radio_of(memory.radios(), 4).account;
  };
  EXPECT_EQ(account_after(300.0, 0.0), RadioAccount::as_listed);
  EXPECT_NE(account_after(45.0, 1.0), RadioAccount::as_listed);
  EXPECT_EQ(account_after(60.0, 0.0), RadioAccount::as_listed);
}

// For a while either of two radios may be the wrong one, each with the robot at another place.
TEST(RadioFaults, IsTornUntilTheDataTellWhichRadioIsWrong) {
  DriveAmongRadios drive;
  std::vector<Beacon> listed = drive.beacons;
  listed[3].position.x() += 2.0;
  RangeMemory memory({}, listed);
  double largest_error = 0.0;
  int steps = 0;
  drive.drive(24.0, 2, [&](const OdometryIncrement& increment, const RangeObservation& range) {
    memory.add(increment, {range});
    if (++steps % 20 != 0) return;
    memory.solve();
    if (steps < 80) return;
    EXPECT_GT(memory.radios()[0].fault + memory.radios()[3].fault, 0.7) << steps;
    EXPECT_EQ(memory.radios()[0].account, RadioAccount::as_listed) << steps;
    const double error = drive.error(memory);
    largest_error = std::max(largest_error, error);
    EXPECT_TRUE(error < 0.3 || memory.is_torn()) << steps;
  });
  EXPECT_GT(largest_error, 0.5);
  EXPECT_FALSE(memory.is_torn());
  EXPECT_GT(memory.radios()[3].fault, 0.95);
}

// After ten seconds any of three radios may be the wrong one, the third at many places.
TEST(RadioFaults, ARadioThatMayBeWrongIsNotForgottenForVariantsOfAnother) {
  for (const unsigned seed : {1U, 3U, 4U}) {
    DriveAmongRadios drive;
    std::vector<Beacon> listed = drive.beacons;
    listed[2].position.y() -= 1.5;
    RangeMemory memory({}, listed);
    drive.drive(10.0, seed, &memory);
    const std::vector<RadioKnowledge> radios = memory.radios();
    for (const int id : {1, 3, 4}) {
      EXPECT_GT(radio_of(radios, id).fault, 0.01) << "radio " << id << ", seed " << seed;
    }
  }
}

TEST(RadioFaults, NamesTheRadioThatRepeatsAnother) {
  DriveAmongRadios drive;
  drive.radio_that_repeats = 2;
  RangeMemory memory({}, drive.beacons);
  drive.drive(120.0, 6, &memory);
  const std::vector<RadioKnowledge> radios = memory.radios();
  EXPECT_EQ(radio_of(radios, 3).account, RadioAccount::elsewhere);
  EXPECT_EQ(radio_of(radios, 3).in_place_of, 1);
  EXPECT_EQ(radio_of(radios, 1).account, RadioAccount::as_listed);
}

// What is the same to the bit would count as one more opinion, and is late. What the radio measures
// itself afterwards counts again.
TEST(RadioFaults, LeavesOutARadioThatCopiesAnother) {
  DriveAmongRadios drive;
  drive.radio_that_repeats = 2;
  drive.repeats_exactly = true;
  RangeMemoryOptions options;
  options.most_keyframes = 10;  // the oldest leave, and with them radios that are not heard
  RangeMemory memory(options, drive.beacons);
  drive.drive(20.0, 6, &memory);
  for (unsigned seed = 100; seed < 140; ++seed) {
    drive.drive(1.0, seed, &memory);
    EXPECT_TRUE(radio_of(memory.radios(), 3).repeats) << seed;
  }
  for (const RadioKnowledge& radio : memory.radios()) {
    EXPECT_EQ(radio.repeats, radio.id == 3);
    EXPECT_EQ(radio.in_place_of, radio.id == 3 ? 1 : -1);
    EXPECT_EQ(radio.account, RadioAccount::as_listed);
    EXPECT_EQ(radio.ranges == 0, radio.id == 3);
  }
  drive.radio_that_repeats = -1;
  drive.drive(60.0, 8, &memory);
  EXPECT_FALSE(radio_of(memory.radios(), 3).repeats);
  EXPECT_GT(radio_of(memory.radios(), 3).ranges, 10);
  EXPECT_LT(radio_of(memory.radios(), 3).fault, 0.5);
}

}  // namespace
}  // namespace pf_resampling
