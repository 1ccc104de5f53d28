#include "pf_resampling_core/range_memory/range_memory.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <random>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/simulation/simulate.hpp"
#include "pf_resampling_core/test/range_memory/drive_among_radios.hpp"

namespace pf_resampling {
namespace {

using Common = CommonUnknown;

/// Of an error in standard deviations: beyond 5 one time in two million.
void expect_near(double value, double truth, double sigma, const char* what) {
  EXPECT_LT(std::abs(value - truth), 5.0 * sigma) << what << " " << value << " ± " << sigma;
}

// Where the robot may be, of all modes: half a metre apart.
int places_of(const RangeMemory& memory) {
  std::vector<Eigen::Vector2d> places;
  for (const RangeMode& mode : memory.modes()) {
    const Eigen::Vector2d place = mode.estimate.keyframes.back().head<2>();
    const auto is_near = [&](const Eigen::Vector2d& other) { return (other - place).norm() < 0.5; };
    if (std::none_of(places.begin(), places.end(), is_near)) places.push_back(place);
  }
  return static_cast<int>(places.size());
}

TEST(RangeMemory, FindsPoseCalibrationWheelsAndAntenna) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    DriveAmongRadios drive;
    drive.distance_scale = 1.03;
    drive.antenna = {0.4, -0.1, 0.8};
    for (Beacon& beacon : drive.beacons) {
      beacon.is_planar = false;
      beacon.position.z() = 2.0;
    }
    RangeMemory memory({}, drive.beacons);
    drive.drive(240.0, seed, &memory);
    ASSERT_EQ(places_of(memory), 1);
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
    expect_constant(Common::lever_z, 0.8, 0.15, "lever z");
    for (const RadioKnowledge& radio : memory.radios()) {
      EXPECT_EQ(radio.account, RadioAccount::as_listed) << "radio " << radio.id;
    }
  }
}

// With 1.35 %, one in six scales of drives whose wheels are 2 % off was beyond 2 sigma at first.
TEST(RangeMemory, TakesWheelsToBeTwoPercentOffAtFirst) {
  DriveAmongRadios drive;
  RangeMemory memory({}, drive.beacons);
  drive.drive(8.0, 3, &memory);
  const RangeMemory::Newest newest = memory.newest(memory.modes().front());
  for (const int scale : {Common::distance_scale, Common::turn_scale}) {
    const int at = KeyframeUnknown::count + scale;
    EXPECT_NEAR(std::sqrt(newest.covariance(at, at)), 0.02, 0.002);
  }
}

// Wheels counted four times, a gyro with the wrong sign: no radio is accused. What turns show may
// come late.
TEST(RangeMemory, FindsOdometryThatCountsSeveralTimesOrTurnsTheWrongWay) {
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

// Were each of them free from the start, the poses of a drive without them would be half as good.
TEST(RangeMemory, TakesErrorsForSmallUntilTheDataSayOtherwise) {
  const auto loose_after = [](DriveAmongRadios drive) {
    RangeMemory memory({}, drive.beacons);
    drive.drive(120.0, 3, &memory);
    EXPECT_LT(drive.error(memory), 0.15);
    return memory.modes().front().loose;
  };
  EXPECT_EQ(loose_after({}), LooseErrors{});
  DriveAmongRadios on_a_post;
  on_a_post.beacons[0].position.z() = 2.0;
  EXPECT_TRUE(loose_after(on_a_post)[LooseError::heights]);
}

// Were they four heights of their own, each pose would have to pay for four.
TEST(RangeMemory, FindsTheHeightThatRadiosHaveInCommon) {
  DriveAmongRadios drive;
  for (Beacon& beacon : drive.beacons) beacon.position.z() = 1.5;
  RangeMemory memory({}, drive.beacons);
  drive.drive(240.0, 3, &memory);
  const RangeMemory::Newest newest = memory.newest(memory.modes().front());
  constexpr int kAt = KeyframeUnknown::count + Common::height;
  const double sigma = std::sqrt(newest.covariance(kAt, kAt));
  EXPECT_LT(sigma, 0.6);
  expect_near(newest.mean[kAt], 1.5 * 1.5, sigma, "height");
}

// 15 s do not tell whether radios differ: with one of both alone the belief was too sure.
TEST(RangeMemory, BelievesInAnErrorByHalvesUntilTheDataTell) {
  DriveAmongRadios drive;
  RangeMemory memory({}, drive.beacons);
  drive.drive(15.0, 3, &memory);
  EXPECT_EQ(places_of(memory), 1);
  double loose = 0.0;
  for (const RangeMode& mode : memory.modes()) {
    if (mode.loose[LooseError::radios]) loose += mode.probability;
  }
  EXPECT_GT(loose, 0.02);
  EXPECT_LT(loose, 0.98);
}

// Wheels 3 % long, and radios that differ by half of what they may: with a tenth of it, as a belief
// without such errors had it, every second pose was beyond 3 sigma.
TEST(RangeMemory, IsNotTooSureAmongRadiosThatDifferALittle) {
  int poses = 0, beyond = 0;
  for (const unsigned seed : {1U, 2U, 3U, 4U}) {
    DriveAmongRadios drive;
    drive.sigma = 0.04;
    drive.reflected = 0.0;
    drive.distance_scale = 1.03;
    drive.beacons[0].position = {-1.0, -7.5, 0.0};
    drive.beacons[1].position = {18.5, -4.0, 0.0};
    drive.beacons[2].position = {-0.3, 6.0, 0.0};
    drive.beacons[3].position = {-19.5, 5.3, 0.0};
    RangeMemory memory({}, drive.beacons);
    int steps = 0;
    drive.drive(60.0, seed, [&](const OdometryIncrement& increment, RangeObservation range) {
      const double more = range.beacon % 2 == 0 ? -0.5 : 0.5;
      range.range +=
          more * (RangeMemoryOptions{}.own_scale * range.range + RangeMemoryOptions{}.own_bias);
      memory.add(increment, {range});
      if (++steps % 50 != 0) return;
      memory.solve();
      if (steps < 300) return;
      const RangeMemory::Newest newest = memory.newest(memory.modes().front());
      const Eigen::Vector2d off =
          newest.mean.head<2>() - Eigen::Vector2d(drive.truth.x, drive.truth.y);
      ++poses;
      if (off.dot(newest.covariance.topLeftCorner<2, 2>().inverse() * off) > 11.8) ++beyond;
    });
  }
  EXPECT_LT(beyond, poses / 4);
}

// From two that are swapped, single steps lead to paths that are mirrored, with others accused.
// Until it turns, a mirrored robot may be right; and one that is turned by half a turn, but for
// heights.
TEST(RangeMemory, NamesTwoThatAreSwappedAtOnce) {
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
TEST(RangeMemory, NamesNobodyAfterAFewRanges) {
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

// On a circle, what radios differ by looks like a longer circle, seen by short wheels.
TEST(RangeMemory, RadiosThatDifferAreNotTakenForShortWheels) {
  World world;
  world.start = {10.0, 0.0, 0.5 * kPi};
  world.repeat = true;
  world.duration = 300.0;
  for (int i = 1; i <= 24; ++i) {
    world.waypoints.emplace_back(10.0 * std::cos(kPi * i / 12.0), 10.0 * std::sin(kPi * i / 12.0));
  }
  const auto add = [&](double x, double y, double scale, double bias) {
    SimulatedBeacon radio;
    radio.beacon.id = static_cast<int>(world.beacons.size());
    radio.beacon.position = {x, y, 0.0};
    radio.beacon.is_planar = true;
    radio.errors = {scale, bias, 0.4};
    world.beacons.push_back(radio);
  };
  add(-13.0, -12.0, 1.015, 0.25);
  add(12.5, -13.5, 1.010, 0.10);
  add(14.0, 1.0, 1.020, 0.30);
  add(11.0, 13.5, 1.005, 0.20);
  add(-10.5, 13.0, 1.015, 0.15);
  add(-14.5, -1.0, 1.025, 0.20);
  world.odometry.speed_sigma = 0.05;
  world.odometry.lateral_sigma = 0.03;
  world.odometry.yaw_rate_sigma = 0.006;
  world.odometry.distance_scale = 1.005;
  world.odometry.yaw_scale = 1.003;
  world.ranges.rate = 6.0;
  world.ranges.outlier_share = world.ranges.reflected_share = 0.03;
  world.ranges.outlier_max = 40.0;
  world.ranges.reflected_excess_mean = 2.0;
  double sum = 0.0;
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const SimulatedDrive drive = simulate(world, seed);
    std::vector<Beacon> beacons;
    for (const SimulatedBeacon& radio : world.beacons) beacons.push_back(radio.beacon);
    RangeMemory memory({}, beacons);
    std::size_t next = 0;
    for (std::size_t i = 1; i < drive.odometry.size(); ++i) {
      const auto& before = drive.odometry[i - 1];
      const auto& now = drive.odometry[i];
      OdometryIncrement increment;
      append(OdometryNoise{}, relative(before.pose, now.pose), now.time - before.time, &increment);
      std::vector<RangeObservation> ranges;
      for (; next < drive.ranges.size() && drive.ranges[next].time <= now.time; ++next) {
        ranges.push_back({drive.ranges[next].beacon, drive.ranges[next].range});
        ranges.back().antenna_is_stated = true;
      }
      memory.add(increment, ranges);
      if (i % 50 == 0) memory.solve();
    }
    const RangeMemory::Newest newest = memory.newest(memory.modes().front());
    sum += newest.mean[KeyframeUnknown::count + Common::distance_scale];
  }
  EXPECT_NEAR(sum / 3.0, 0.005, 0.015);
}

// A loss that is too narrow throws away what good ranges say.
TEST(RangeMemory, FindsHowWildRangesAre) {
  const auto width_after = [](double reflected) {
    DriveAmongRadios drive;
    drive.reflected = reflected;
    RangeMemory memory({}, drive.beacons);
    drive.drive(120.0, 3, &memory);
    return memory.noise().robust_width;
  };
  EXPECT_GT(width_after(0.0), 4.0);
  EXPECT_LT(width_after(0.1), 4.0);
}

// The path follows them, and their residuals are small.
TEST(RangeMemory, DoubtsRangesThatErrAlikeForAWhile) {
  const auto doubt_after = [](double error) {
    DriveAmongRadios drive;
    drive.sigma = 0.5;
    RangeMemory memory({}, drive.beacons);
    int steps = 0;
    drive.drive(240.0, 3, [&](const OdometryIncrement& increment, RangeObservation range) {
      range.range += error * std::sin(0.01 * steps * range.beacon);
      memory.add(increment, steps % 3 == 0 ? std::vector{range} : std::vector<RangeObservation>{});
      if (++steps % 50 == 0) memory.solve();
    });
    return memory.doubt();
  };
  EXPECT_LT(doubt_after(0.0), 1.2);
  EXPECT_GT(doubt_after(0.5), 1.5);
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

// From where the drive begins it looks like one with a bias, and later others would be accused.
TEST(RangeMemory, TakesARadioWithABiasForOneElsewhereOnceTheDataSaySo) {
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
TEST(RangeMemory, NamesNoRadioBeforeTheFirstTurn) {
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

// Ranges of minutes before would outvote those since for as long again.
TEST(RangeMemory, ARadioThatChangesIsNamedSoonAndClearedSoon) {
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

TEST(RangeMemory, ARadioThatNobodyListedAndThatIsMovedIsFoundAgain) {
  DriveAmongRadios drive;
  RangeMemory memory({}, {});
  drive.drive(200.0, 7, &memory);
  drive.beacons[2].position += Eigen::Vector3d(-3.0, 1.0, 0.0);
  drive.drive(60.0, 8, &memory);
  const auto place_of = [&](int id) -> Eigen::Vector2d {
    return radio_of(memory.radios(), id).places.at(0).position;
  };
  for (const int other : {1, 2, 4}) {
    const Eigen::Vector3d apart =
        drive.beacons[2].position - drive.beacons[static_cast<std::size_t>(other) - 1].position;
    EXPECT_NEAR((place_of(3) - place_of(other)).norm(), apart.norm(), 0.4) << "radio " << other;
  }
}

// For a while either of two radios may be the wrong one, each with the robot at another place.
TEST(RangeMemory, IsTornUntilTheDataTellWhichRadioIsWrong) {
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
TEST(RangeMemory, ARadioThatMayBeWrongIsNotForgottenForVariantsOfAnother) {
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

// What is the same to the bit would count as one more opinion, and is late. What the radio measures
// itself afterwards counts again.
TEST(RangeMemory, LeavesOutARadioThatCopiesAnother) {
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

TEST(RangeMemory, WithTwoRadiosTheRobotMayBeOnEitherSideUntilItTurns) {
  DriveAmongRadios drive;
  drive.straight = 20.0;
  drive.truth = {-22.0, -2.0, 0.0};
  drive.beacons.resize(2);
  RangeMemory memory({}, drive.beacons);
  drive.drive(40.0, 11, &memory);
  ASSERT_EQ(places_of(memory), 2);
  drive.drive(160.0, 12, &memory);
  ASSERT_EQ(places_of(memory), 1);
  EXPECT_LT(drive.error(memory), 0.4);
}

RangeMemoryOptions with_most(int keyframes) {
  RangeMemoryOptions options;
  options.most_keyframes = keyframes;
  return options;
}

// What old keyframes say of constants and pose stays when they leave.
TEST(RangeMemory, OfALongDriveTheOldestLeave) {
  DriveAmongRadios drive;
  drive.distance_scale = 1.03;
  drive.antenna = {0.4, -0.1, 0.0};
  RangeMemory whole({}, drive.beacons);
  RangeMemory some(with_most(120), drive.beacons);
  int steps = 0;
  drive.drive(900.0, 3, [&](const auto& increment, const auto& range) {
    for (RangeMemory* memory : {&whole, &some}) memory->add(increment, {range});
    if (++steps % 50 != 0) return;
    for (RangeMemory* memory : {&whole, &some}) memory->solve();
  });
  EXPECT_GT(whole.graph().keyframes(), 500);
  // A minute's more, as solutions of all are rare by now.
  EXPECT_LT(some.graph().keyframes(), 200);
  EXPECT_LT(drive.error(some), 0.2);
  const RangeMemory::Newest of_whole = whole.newest(whole.modes().front());
  const RangeMemory::Newest of_some = some.newest(some.modes().front());
  for (const int constant : {Common::distance_scale, Common::lever_x, Common::bias}) {
    const int at = KeyframeUnknown::count + constant;
    const double sigma = std::sqrt(of_whole.covariance(at, at));
    EXPECT_NEAR(of_some.mean[at], of_whole.mean[at], 3.0 * sigma) << constant;
    EXPECT_LT(std::sqrt(of_some.covariance(at, at)), 1.5 * sigma) << constant;
  }
}

TEST(RangeMemory, NamesTheRadioThatWasMovedLong) {
  DriveAmongRadios drive;
  const std::vector<Beacon> listed = drive.beacons;
  RangeMemory memory(with_most(120), listed);
  drive.drive(400.0, 4, &memory);
  for (const RadioKnowledge& radio : memory.radios()) {
    EXPECT_EQ(radio.account, RadioAccount::as_listed) << "radio " << radio.id;
  }
  drive.beacons[2].position += Eigen::Vector3d(-3.0, 1.0, 0.0);
  drive.drive(300.0, 5, &memory);
  const std::vector<RadioKnowledge> radios = memory.radios();
  EXPECT_EQ(radio_of(radios, 3).account, RadioAccount::elsewhere);
  EXPECT_LT((radio_of(radios, 3).places[0].position - drive.beacons[2].position.head<2>()).norm(),
            0.25);
  EXPECT_LT(drive.error(memory), 0.2);
}

TEST(RangeMemory, WheelsThatMayHaveSlippedAreNotBelieved) {
  DriveAmongRadios drive;
  RangeMemory memory({}, drive.beacons);
  drive.drive(60.0, 4, &memory);
  OdometryIncrement slip;
  append(OdometryNoise{}, {6.0, 0.0, 0.0}, 3.0, &slip);
  slip.slip_covariance = slip_covariance(2.0, 3.0);
  memory.add(slip, {});
  drive.drive(10.0, 5, &memory);
  EXPECT_LT(drive.error(memory), 0.3);
}

// The odometry suspects them when a robot drives faster than ever: the ranges tell.
TEST(RangeMemory, OfWheelsThatMayHaveSlippedTheRangesTellWhetherTheyDid) {
  DriveAmongRadios drive;
  RangeMemory memory({}, drive.beacons);
  drive.drive(60.0, 4, &memory);
  const auto take_suspected = [&](OdometryIncrement increment, const RangeObservation& range) {
    increment.slip_covariance = slip_covariance(0.5, increment.duration);
    memory.add(increment, {range});
    memory.solve();
  };
  drive.drive(10.0, 5, take_suspected);
  EXPECT_FALSE(memory.has_slipped());
  EXPECT_TRUE(memory.slips().empty());
  EXPECT_LT(drive.error(memory), 0.3);
  drive.distance_scale = 3.0;
  drive.drive(5.0, 6, take_suspected);
  EXPECT_TRUE(memory.has_slipped());
  EXPECT_EQ(memory.slips().size(), 1U);
  EXPECT_LT(drive.error(memory), 0.5);
}

// The slip that they look for takes a metre, or two seconds, to show.
TEST(RangeMemory, FindsWhenTheWheelsSlipped) {
  DriveAmongRadios drive;
  RangeMemory memory({}, drive.beacons);
  double largest = 0.0;
  int steps = 0;
  const auto take = [&](const OdometryIncrement& increment, const RangeObservation& range) {
    memory.add(increment, {range});
    if (++steps % 3 != 0) return;
    memory.solve();
    if (!memory.modes().empty() && steps > 100) largest = std::max(largest, drive.error(memory));
  };
  drive.drive(60.0, 4, take);
  EXPECT_TRUE(memory.slips().empty());
  const Pose2 before = drive.truth;
  drive.distance_scale = 0.0;  // locked
  drive.drive(8.0, 5, take);
  EXPECT_TRUE(memory.has_slipped());
  const Pose2 moved = relative(before, drive.truth);
  drive.distance_scale = 1.0;
  drive.drive(20.0, 6, take);
  EXPECT_FALSE(memory.has_slipped());
  ASSERT_EQ(memory.slips().size(), 1U);
  const RangeSlip slip = memory.slips().front();
  EXPECT_NEAR(slip.begin, 60.0, 2.5);
  EXPECT_NEAR(slip.end, 68.0, 2.5);
  EXPECT_NEAR(slip.size, std::hypot(moved.x, moved.y), 1.0);
  EXPECT_LT(largest, 1.0);
  EXPECT_LT(drive.error(memory), 0.2);
  for (int id = 1; id <= 4; ++id) {
    EXPECT_EQ(radio_of(memory.radios(), id).account, RadioAccount::as_listed) << "radio " << id;
  }
}

// Along a hall, of which few are heard at a time.
TEST(RangeMemory, MoreRadiosThanCanBeSolvedForAtOnce) {
  DriveAmongRadios drive;
  drive.straight = 300.0;
  drive.truth = {-5.0, 0.0, 0.0};
  std::vector<Beacon> hall;
  for (int i = 0; i < 60; ++i) {
    Beacon beacon;
    beacon.id = i;
    beacon.position = {4.0 * i, i % 2 == 0 ? 6.0 : -7.0, 0.0};
    beacon.is_planar = true;
    hall.push_back(beacon);
  }
  RangeMemory memory({}, hall);
  for (int i = 0; i < 54; ++i) {
    drive.beacons = {hall.begin() + i, hall.begin() + i + 6};
    drive.drive(8.0, 100U + static_cast<unsigned>(i), &memory);
    if (i > 3) {
      ASSERT_LT(drive.error(memory), 0.5) << "at " << drive.truth.x;
    }
  }
  EXPECT_GT(drive.truth.x, 200.0);
  EXPECT_FALSE(memory.number_of(0).has_value());
  EXPECT_TRUE(memory.number_of(58).has_value());
  EXPECT_EQ(memory.radios().size(), 60U);
}

TEST(RangeMemory, BeaconsWithOneIdAreToldOf) {
  DriveAmongRadios drive;
  drive.beacons[1].id = 1;
  EXPECT_THROW(RangeMemory({}, drive.beacons), Error);
}

}  // namespace
}  // namespace pf_resampling
