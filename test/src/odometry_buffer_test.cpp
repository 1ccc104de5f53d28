#include "src/odometry/odometry_buffer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

StampedOdometry at(double time, double x, double y = 0.0, double heading = 0.0) {
  StampedOdometry odometry;
  odometry.stamp = ros::Time(time);
  odometry.pose = {x, y, heading};
  return odometry;
}

/// Pose on a circle of `radius` to the left, at `speed`, after `time` seconds from the origin.
Pose2 on_circle(double radius, double speed, double time) {
  const double angle = speed * time / radius;
  return {radius * std::sin(angle), radius * (1.0 - std::cos(angle)), angle};
}

using Addition = OdometryBuffer::Addition;

TEST(OdometryBuffer, IntegratesBetweenMessagesAlongTheArc) {
  // At constant speed and turn rate the robot drives a circle, so poses between messages are known.
  OdometryBuffer buffer;
  for (int i = 0; i <= 20; ++i) {
    const Pose2 pose = on_circle(3.0, 2.0, 0.5 * i);
    ASSERT_EQ(buffer.add(at(100.0 + 0.5 * i, pose.x, pose.y, wrap_angle(pose.heading))),
              Addition::added);
  }
  for (const auto& [from, to] :
       {std::pair{0.2, 0.4}, {0.2, 3.3}, {1.0, 7.5}, {0.0, 10.0}, {4.1, 4.1}}) {
    const OdometryIncrement increment =
        buffer.integrate(ros::Time(100.0 + from), ros::Time(100.0 + to), OdometryNoise{});
    const Pose2 expected = on_circle(3.0, 2.0, to - from);
    EXPECT_NEAR(increment.mean.x, expected.x, 1e-6) << from << " to " << to;
    EXPECT_NEAR(increment.mean.y, expected.y, 1e-6);
    EXPECT_NEAR(wrap_angle(increment.mean.heading - expected.heading), 0.0, 1e-6);
    EXPECT_NEAR(increment.duration, to - from, 1e-6);
  }
}

TEST(OdometryBuffer, ExtendingGivesTheSameAsIntegratingAtOnce) {
  OdometryBuffer buffer;
  for (int i = 0; i <= 10; ++i) {
    const Pose2 pose = on_circle(2.0, 1.0, 0.1 * i);
    buffer.add(at(50.0 + 0.1 * i, pose.x, pose.y, pose.heading));
  }
  const OdometryNoise noise;
  OdometryIncrement pieces = buffer.integrate(ros::Time(50.1), ros::Time(50.3), noise);
  buffer.extend(ros::Time(50.3), ros::Time(50.9), noise, &pieces);
  const OdometryIncrement whole = buffer.integrate(ros::Time(50.1), ros::Time(50.9), noise);
  EXPECT_NEAR(pieces.mean.x, whole.mean.x, 1e-9);
  EXPECT_NEAR(pieces.mean.heading, whole.mean.heading, 1e-9);
  EXPECT_LT((pieces.covariance - whole.covariance).norm(), 1e-9);
  EXPECT_LT((pieces.yaw_rate_sensitivity - whole.yaw_rate_sensitivity).norm(), 1e-9);
}

TEST(OdometryBuffer, SaysWhatItCovers) {
  OdometryBuffer buffer;
  EXPECT_FALSE(buffer.covers(ros::Time(1.0)));
  EXPECT_THROW(buffer.integrate(ros::Time(1.0), ros::Time(2.0), {}), Error);
  buffer.add(at(10.0, 0.0));
  buffer.add(at(11.0, 1.0));
  EXPECT_TRUE(buffer.covers(ros::Time(10.0)));
  EXPECT_TRUE(buffer.covers(ros::Time(11.0)));
  EXPECT_FALSE(buffer.covers(ros::Time(9.999)));
  EXPECT_FALSE(buffer.covers(ros::Time(11.001)));
  EXPECT_THROW(buffer.integrate(ros::Time(10.5), ros::Time(11.5), {}), Error);
  EXPECT_THROW(buffer.integrate(ros::Time(10.8), ros::Time(10.2), {}), Error);
}

TEST(OdometryBuffer, IsBounded) {
  OdometryBufferOptions options;
  options.length = 5.0;
  OdometryBuffer buffer(options);
  for (int i = 0; i < 10000; ++i) buffer.add(at(100.0 + 0.1 * i, 0.1 * i));
  EXPECT_LE(buffer.size(), 53);
  EXPECT_TRUE(buffer.covers(buffer.newest() - ros::Duration(5.0)));
}

TEST(OdometryBuffer, DropsWhatIsNotNewer) {
  OdometryBuffer buffer;
  buffer.add(at(10.0, 0.0));
  buffer.add(at(10.2, 0.2));
  EXPECT_EQ(buffer.add(at(10.2, 0.2)), Addition::out_of_order);
  EXPECT_EQ(buffer.add(at(10.1, 0.1)), Addition::out_of_order);
  EXPECT_EQ(buffer.size(), 2);
  EXPECT_EQ(buffer.add(at(10.3, 0.3)), Addition::added);
}

/// Adds messages 0.1 s and 0.1 m apart, from `first` and `x` on; what became of the last.
Addition add_in_a_row(int count, double first, double x, OdometryBuffer* buffer) {
  Addition last = Addition::added;
  for (int i = 0; i < count; ++i) last = buffer->add(at(first + 0.1 * i, x + 0.1 * i));
  return last;
}

TEST(OdometryBuffer, AFewMessagesFromThePastChangeNothingFiveStartOver) {
  OdometryBuffer buffer;
  add_in_a_row(2, 100.0, 0.0, &buffer);
  EXPECT_EQ(add_in_a_row(4, 10.0, 5.0, &buffer), Addition::time_jump);
  EXPECT_EQ(buffer.add(at(100.2, 0.2)), Addition::added);
  EXPECT_EQ(buffer.newest(), ros::Time(100.2));

  // What continued the old time took the four back: it takes five again.
  EXPECT_EQ(add_in_a_row(4, 10.4, 5.4, &buffer), Addition::time_jump);
  EXPECT_EQ(buffer.newest(), ros::Time(100.2));
  EXPECT_EQ(buffer.add(at(10.8, 5.8)), Addition::time_jumped);
  EXPECT_EQ(buffer.oldest(), ros::Time(10.4));
  EXPECT_EQ(buffer.newest(), ros::Time(10.8));
  EXPECT_EQ(buffer.add(at(10.9, 5.9)), Addition::added);
}

TEST(OdometryBuffer, MessagesFromAheadInPairsAndMoreAreNotBelieved) {
  // 50 Hz, and of every ten messages four in a row have a clock that is half an hour ahead.
  OdometryBuffer buffer;
  int accepted = 0;
  for (int i = 0; i < 1000; ++i) {
    const bool is_ahead = i % 10 >= 3 && i % 10 < 7;
    const double time = 100.0 + 0.02 * i;
    const Addition addition = buffer.add(at(time + (is_ahead ? 1800.0 : 0.0), 0.01 * i));
    EXPECT_EQ(addition, is_ahead ? Addition::time_gap : Addition::added) << i;
    accepted += addition == Addition::added ? 1 : 0;
  }
  EXPECT_EQ(accepted, 600);
  EXPECT_EQ(buffer.newest(), ros::Time(100.0 + 0.02 * 999));
  // Nothing of the way is lost, as the messages between are not needed to know it.
  const OdometryIncrement increment =
      buffer.integrate(ros::Time(100.0), buffer.newest(), OdometryNoise{});
  EXPECT_NEAR(increment.mean.x, 9.99, 1e-9);
}

TEST(OdometryBuffer, ABagThatLoopsIsFollowedAlthoughItsMessagesComeTwice) {
  OdometryBuffer buffer;
  add_in_a_row(100, 100.0, 0.0, &buffer);
  int needed = 0;
  for (int i = 0; i < 20 && buffer.newest() > ros::Time(105.0); ++i) {
    buffer.add(at(100.0 + 0.1 * i, 0.1 * i));
    EXPECT_NE(buffer.add(at(100.0 + 0.1 * i, 0.1 * i)), Addition::added);
    ++needed;
  }
  EXPECT_EQ(needed, 5);
}

TEST(OdometryBuffer, MessagesThatDoNotContinueOneAnotherAreNotBelieved) {
  OdometryBuffer buffer;
  add_in_a_row(2, 100.0, 0.0, &buffer);
  for (int i = 0; i < 100; ++i) {  // each from a time of its own
    EXPECT_EQ(buffer.add(at(1000.0 + 10.0 * i, 0.0)), Addition::time_gap);
  }
  EXPECT_EQ(buffer.newest(), ros::Time(100.1));
}

TEST(OdometryBuffer, AfterAJumpOfThePoseTheRobotMovesOnAsBefore) {
  OdometryBufferOptions options;
  options.confirmations = 3;
  OdometryBuffer buffer(options);
  buffer.add(at(100.0, 0.0));
  buffer.add(at(100.1, 0.1));
  // Two false poses.
  EXPECT_EQ(buffer.add(at(100.2, 500.0)), Addition::pose_jump);
  EXPECT_EQ(buffer.add(at(100.3, 500.1)), Addition::pose_jump);
  EXPECT_EQ(buffer.add(at(100.4, 0.4)), Addition::added);
  // The odometry starts again somewhere else, turned.
  EXPECT_EQ(buffer.add(at(100.5, 500.0, 0.0, kPi / 2)), Addition::pose_jump);
  EXPECT_EQ(buffer.add(at(100.6, 500.0, 0.1, kPi / 2)), Addition::pose_jump);
  EXPECT_EQ(buffer.add(at(100.7, 500.0, 0.2, kPi / 2)), Addition::pose_jumped);
  EXPECT_DOUBLE_EQ(buffer.newest_pose().x, 500.0);
  const OdometryIncrement increment =
      buffer.integrate(ros::Time(100.0), ros::Time(100.7), OdometryNoise{});
  EXPECT_NEAR(increment.mean.x, 0.7, 1e-9);  // 0.4 before the jump, 0.2 after it, 0.1 between
  EXPECT_NEAR(increment.mean.y, 0.0, 1e-9);
  EXPECT_NEAR(increment.duration, 0.7, 1e-9);
}

/// A robot that goes round an oval at 0.5 m/s, with 1 % of noise, for a minute.
struct Oval {
  explicit Oval(double rate) : period(1.0 / rate) {}
  Pose2 pose(int i) const {
    const double u = 0.15 * period * i;  // rad; 4 m by 2.8 m
    return {4.0 * std::cos(u), 2.8 * std::sin(u),
            std::atan2(2.8 * std::cos(u), -4.0 * std::sin(u))};
  }
  int count() const { return static_cast<int>(60.0 / period); }
  StampedOdometry message(int i, const Pose2& start = {}) const {
    Pose2 there = compose(start, relative(pose(0), pose(i)));
    there.x += 0.005 * std::sin(1.7 * i);
    there.y += 0.005 * std::sin(2.3 * i);
    return at(100.0 + period * i, there.x, there.y, there.heading);
  }
  double period;  // s
};

/// What the buffer makes of the whole drive, and how far that is from what it was, m.
double error_of(const OdometryBuffer& buffer, const Oval& drive) {
  const Pose2 found = buffer.integrate(buffer.oldest(), buffer.newest(), OdometryNoise{}).mean;
  const Pose2 expected = relative(drive.pose(0), drive.pose(drive.count() - 1));
  return std::hypot(found.x - expected.x, found.y - expected.y);
}

OdometryBufferOptions long_enough() {
  OdometryBufferOptions options;
  options.length = 1000.0;
  return options;
}

// The base starts again, its odometry at another place, near or far: the robot moved in that step
// as it did before and after. From half a metre on, at all rates, into all directions.
TEST(OdometryBuffer, AnOdometryThatStartsAgainMovesNothing) {
  for (const double rate : {1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0}) {
    for (const double distance : {0.5, 0.7, 1.0, 2.0, 5.5, 40.0, 3000.0}) {
      for (int direction = 0; direction < 8; ++direction) {
        const double angle = 0.25 * kPi * direction;
        const Oval drive(rate);
        OdometryBuffer buffer(long_enough());
        int jumps = 0;
        for (int i = 0; i < drive.count(); ++i) {
          const Pose2 start = i < drive.count() * 2 / 3 ? Pose2{}
                                                        : Pose2{distance * std::cos(angle),
                                                                distance * std::sin(angle), 0.0};
          jumps += buffer.add(drive.message(i, start)) == Addition::pose_jumped ? 1 : 0;
        }
        const std::string what = std::to_string(rate) + " Hz, " + std::to_string(distance) +
                                 " m, " + std::to_string(direction);
        EXPECT_EQ(jumps, 1) << what;
        EXPECT_LT(error_of(buffer, drive), 0.1) << what;
      }
    }
  }
}

// Where it is put back to the origin, heading and all.
TEST(OdometryBuffer, AnOdometryThatIsSetToZeroMovesNothing) {
  for (const double rate : {1.0, 5.0, 20.0, 100.0}) {
    for (const int part : {4, 5, 6, 7}) {
      const Oval drive(rate);
      const int again = drive.count() * part / 8;
      OdometryBuffer buffer(long_enough());
      for (int i = 0; i < drive.count(); ++i) {
        const Pose2 start =
            i < again ? Pose2{} : relative(relative(drive.pose(0), drive.pose(again)), {});
        buffer.add(drive.message(i, start));
      }
      EXPECT_LT(error_of(buffer, drive), 0.1 + 0.1 / rate) << rate << " Hz, " << part;
    }
  }
}

// Nothing of what the robot drives is lost: not when it starts, brakes or turns as it never did,
// nor when messages are lost, nor when its odometry is noisy.
TEST(OdometryBuffer, WhatARobotDrivesForTheFirstTimeIsNoJump) {
  for (const double rate : {1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0}) {
    OdometryBuffer buffer(long_enough());
    const int second = static_cast<int>(rate);
    Pose2 pose;
    int i = 0, jumps = 0;
    const auto drive = [&](double seconds, double speed, double turn) {
      for (int step = 0; step < seconds * second; ++step, ++i) {
        jumps +=
            buffer.add(at(100.0 + i / rate, pose.x, pose.y, pose.heading)) == Addition::pose_jumped;
        pose = compose(pose, motion_of({speed, 0.0, turn}, 1.0 / rate));
      }
    };
    drive(20.0, 0.0, 0.0);
    drive(30.0, 0.5, 0.0);
    drive(10.0, 0.0, 0.0);
    drive(10.0, 2.0, 0.1);
    drive(10.0, 0.5, 0.0);
    drive(3.0, 0.0, 0.8);
    drive(10.0, 4.0, 0.0);
    drive(5.0, -1.0, 0.0);
    const Pose2 last = pose;
    drive(5.0, 0.0, 0.0);
    EXPECT_EQ(jumps, 0) << rate << " Hz";
    const Pose2 found = buffer.integrate(buffer.oldest(), buffer.newest(), OdometryNoise{}).mean;
    EXPECT_NEAR(found.x, last.x, 1e-6) << rate << " Hz";
    EXPECT_NEAR(found.y, last.y, 1e-6) << rate << " Hz";
  }
}

TEST(OdometryBuffer, LostMessagesAreNoJump) {
  for (const double rate : {2.0, 10.0, 50.0}) {
    const Oval drive(rate);
    OdometryBuffer buffer(long_enough());
    int jumps = 0;
    for (int i = 0; i < drive.count(); ++i) {
      const double time = drive.period * i;
      const bool is_lost = std::fmod(time, 10.0) > 6.0 || i % 7 == 3;  // for four seconds, too
      if (is_lost && i + 1 < drive.count()) continue;
      jumps += buffer.add(drive.message(i)) == Addition::pose_jumped ? 1 : 0;
    }
    EXPECT_EQ(jumps, 0) << rate << " Hz";
    // Where it went meanwhile is known; the noise of each message is left.
    EXPECT_LT(error_of(buffer, drive), 0.05) << rate << " Hz";
  }
}

TEST(OdometryBuffer, NoiseOfHalfAMetreIsNoJumpForLong) {
  const Oval drive(10.0);
  OdometryBuffer buffer(long_enough());
  int refused = 0;
  for (int i = 0; i < drive.count(); ++i) {
    StampedOdometry message = drive.message(i);
    message.pose.x += 0.25 * std::sin(2.9 * i);
    message.pose.y += 0.25 * std::sin(2.2 * i);
    refused += buffer.add(message) != Addition::added ? 1 : 0;
  }
  EXPECT_LT(refused, 20);
  EXPECT_LT(error_of(buffer, drive), 1.0);
}

TEST(OdometryBuffer, ASilenceIsBridgedOnceConfirmed) {
  OdometryBuffer buffer;
  buffer.add(at(100.0, 0.0));
  buffer.add(at(100.1, 0.1));
  EXPECT_EQ(add_in_a_row(4, 140.0, 8.0, &buffer), Addition::time_gap);
  EXPECT_EQ(buffer.newest(), ros::Time(100.1));
  EXPECT_EQ(buffer.add(at(140.4, 8.4)), Addition::gap_closed);
  const OdometryIncrement increment =
      buffer.integrate(ros::Time(100.0), ros::Time(140.4), OdometryNoise{});
  EXPECT_NEAR(increment.mean.x, 8.4, 1e-9);
}

// Drives 20 s at 1 m/s, then for `duration` s at `speed`, reached within `rise` s, and on as
// before, 33 s in all; where wheels may slip, the variance of the heading grows: returns for how
// long.
double seconds_of_slip(double speed, double rise, double duration = 3.0) {
  OdometryBuffer buffer;
  double x = 0.0;
  for (int i = 0; i <= 660; ++i) {
    const double time = 0.05 * i;
    const double share = std::clamp(std::min(time - 20.0, 20.0 + duration - time) / rise, 0.0, 1.0);
    x += 0.05 * (1.0 + share * (speed - 1.0));
    EXPECT_EQ(buffer.add(at(100.0 + time, x)), Addition::added);
  }
  const OdometryIncrement all =
      buffer.integrate(ros::Time(103.0), ros::Time(133.0), OdometryNoise{});
  return all.slip_covariance(2, 2) / slip_covariance(0.0, 1.0)(2, 2);
}

TEST(OdometryBuffer, WheelsThatAreSuddenlyFasterThanEverMaySlip) {
  EXPECT_NEAR(seconds_of_slip(1.5, 0.05), 3.0, 0.4);
  EXPECT_NEAR(seconds_of_slip(2.5, 0.05), 3.0, 0.4);
  EXPECT_EQ(seconds_of_slip(1.1, 0.05), 0.0) << "hardly faster";
  EXPECT_EQ(seconds_of_slip(1.6, 1.4), 0.0) << "accelerates as robots do";
  EXPECT_NEAR(seconds_of_slip(1.5, 0.05, 11.0), 5.0, 0.4) << "drives so from now on";
}

TEST(CovarianceGrowth, RecoversTheNoiseOfAStep) {
  // Forward: after = F before F' + R Q R', written out here; the function has to find Q again.
  const Pose2 from = {1.0, 2.0, 0.7};
  const Pose2 to = {1.8, 2.9, 0.9};
  Eigen::Matrix3d before;
  before << 0.5, 0.1, 0.02, 0.1, 0.4, 0.01, 0.02, 0.01, 0.05;
  const Eigen::Matrix3d noise = Eigen::Vector3d(0.04, 0.01, 0.002).asDiagonal();
  Eigen::Matrix3d lever = Eigen::Matrix3d::Identity();
  lever(0, 2) = -0.9;
  lever(1, 2) = 0.8;
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<2, 2>() << std::cos(0.7), -std::sin(0.7), std::sin(0.7), std::cos(0.7);
  const Eigen::Matrix3d after =
      lever * before * lever.transpose() + turn * noise * turn.transpose();
  const auto growth = covariance_growth(from, to, before, after);
  ASSERT_TRUE(growth.has_value());
  EXPECT_LT((*growth - noise).norm(), 1e-9);
}

TEST(CovarianceGrowth, SaysNothingOfACovarianceThatDoesNotGrow) {
  const Eigen::Matrix3d constant = 0.01 * Eigen::Matrix3d::Identity();
  EXPECT_FALSE(covariance_growth({0, 0, 0}, {1, 0, 0}, constant, constant).has_value());
  EXPECT_FALSE(covariance_growth({0, 0, 0}, {1, 0, 0}, constant, 0.5 * constant).has_value());
}

TEST(OdometryBuffer, TakesTheNoiseFromGrowingCovariances) {
  OdometryBufferOptions options;
  for (const bool use : {true, false}) {
    options.use_covariance = use;
    OdometryBuffer buffer(options);
    for (int i = 0; i <= 4; ++i) {
      StampedOdometry odometry = at(100.0 + i, 0.0);  // standing, so that growths just add up
      odometry.covariance = Eigen::Matrix3d(
          Eigen::Vector3d(0.1 + 0.3 * i, 0.1 + 0.2 * i, 0.1 + 0.1 * i).asDiagonal());
      buffer.add(odometry);
    }
    const OdometryIncrement increment =
        buffer.integrate(ros::Time(100.5), ros::Time(103.0), OdometryNoise::none());
    const Eigen::Vector3d expected =
        use ? Eigen::Vector3d(0.75, 0.5, 0.25) : Eigen::Vector3d::Zero();
    EXPECT_LT((increment.covariance.diagonal() - expected).norm(), 1e-9);
  }
}

// Of the mean velocity over a step: a tenth of a second at 0.2 m/s is 0.02 m, and counts as 0.04 m.
// What no odometry has (not known, exact, broken) leaves the motion model's noise; without one to
// the side, wheels do not go there: 0.2 mm after a second.
TEST(OdometryBuffer, TakesTheNoiseFromVelocities) {
  const double nan = std::nan("");
  const auto noise_of_a_second = [](const Eigen::Vector3d& variances, bool use,
                                    double speed = 1e-6) {
    OdometryBufferOptions options;
    options.use_twist_covariance = use;
    OdometryBuffer buffer(options);
    for (int i = 0; i <= 10; ++i) {
      StampedOdometry odometry = at(100.0 + 0.1 * i, 0.1 * i * speed);
      odometry.velocity_variances = variances;
      odometry.covariance = 0.01 * Eigen::Matrix3d::Identity();  // constant: it says nothing
      buffer.add(odometry);
    }
    OdometryNoise model = OdometryNoise::none();
    model.translation_per_time = 0.5;
    return Eigen::Vector3d(
        buffer.integrate(ros::Time(100.0), ros::Time(101.0), model).covariance.diagonal());
  };
  const Eigen::Vector3d stated(0.04, 0.01, 0.0025);
  const Eigen::Vector3d of_model = noise_of_a_second(stated, false);
  EXPECT_NEAR(of_model[0], 0.25, 1e-9);
  EXPECT_LT((noise_of_a_second(stated, true) - 4.0 * 0.1 * stated).norm(), 1e-9);
  EXPECT_LT(
      (noise_of_a_second({0.04, 0.0, 0.0025}, true) - Eigen::Vector3d(1.6e-2, 1.6e-7, 1e-3)).norm(),
      1e-9);
  EXPECT_EQ(noise_of_a_second(stated, true, 0.0), of_model);  // the robot stands
  for (const double unknown : {0.0, 1e-9, -0.04, nan, 1e6, 1e308}) {
    EXPECT_EQ(noise_of_a_second({unknown, 0.01, 0.0025}, true), of_model) << unknown;
    EXPECT_EQ(noise_of_a_second({0.04, 0.01, unknown}, true), of_model) << unknown;
  }
}

// Wheels that see four fifths of every turn, and an IMU that sees all of it: the robot is on the
// circle that it drove, and the poses as received are left alone.
TEST(OdometryBuffer, TurnsAsTheImuSays) {
  OdometryBuffer buffer;
  const double step = 0.05;  // rad
  const double chord = 2.0 * 3.0 * std::sin(0.5 * step);
  Pose2 wheels;
  for (int i = 0; i <= 40; ++i) {
    StampedOdometry odometry = at(10.0 + 0.1 * i, wheels.x, wheels.y, wheels.heading);
    odometry.heading = wrap_angle(1.0 + step * i);
    ASSERT_EQ(buffer.add(odometry), Addition::added);
    EXPECT_EQ(buffer.newest_pose().heading, odometry.pose.heading);
    wheels =
        compose(wheels, {chord * std::cos(0.4 * step), chord * std::sin(0.4 * step), 0.8 * step});
  }
  const OdometryIncrement increment =
      buffer.integrate(ros::Time(10.0), ros::Time(14.0), OdometryNoise{});
  const Pose2 expected = on_circle(3.0, 3.0, 40 * step);
  EXPECT_NEAR(increment.mean.x, expected.x, 1e-9);
  EXPECT_NEAR(increment.mean.y, expected.y, 1e-9);
  EXPECT_NEAR(wrap_angle(increment.mean.heading - expected.heading), 0.0, 1e-9);
  // A step of which the IMU says nothing is that of the wheels.
  buffer.add(at(14.1, wheels.x, wheels.y, wheels.heading));
  const OdometryIncrement last =
      buffer.integrate(ros::Time(14.0), ros::Time(14.1), OdometryNoise{});
  EXPECT_NEAR(last.mean.heading, 0.8 * step, 1e-9);
}

TEST(OdometryBuffer, MessagesWithoutEndTakeNoMoreMemory) {
  OdometryBuffer buffer;
  StampedOdometry odometry = at(100.0, 0.0);
  for (std::size_t i = 0; i < 2 * OdometryBuffer::kMost; ++i) {
    odometry.stamp += ros::Duration(0, 1);
    buffer.add(odometry);
    ASSERT_LE(buffer.size(), static_cast<int>(OdometryBuffer::kMost));
  }
  EXPECT_EQ(buffer.newest(), odometry.stamp);
}

}  // namespace
}  // namespace pf_resampling
