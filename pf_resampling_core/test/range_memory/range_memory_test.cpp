#include "pf_resampling_core/range_memory/range_memory.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

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
