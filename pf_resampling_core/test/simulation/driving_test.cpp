#include "pf_resampling_core/simulation/driving.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace pf_resampling {
namespace {

TEST(ArcMotion, ConstantYawRateIsACircle) {
  // Closed form: after the time t the robot is at (r sin wt, r (1 - cos wt)), r = v / w.
  const double speed = 1.5;
  const double yaw_rate = 0.3;
  const double radius = speed / yaw_rate;
  Pose2 pose;
  for (int step = 1; step <= 200; ++step) {
    pose = compose(pose, arc_motion(speed, 0.0, yaw_rate, 0.1));
    const double angle = yaw_rate * 0.1 * step;
    EXPECT_NEAR(pose.x, radius * std::sin(angle), 1e-12);
    EXPECT_NEAR(pose.y, radius * (1.0 - std::cos(angle)), 1e-12);
    EXPECT_NEAR(wrap_angle(pose.heading - angle), 0.0, 1e-12);
  }
}

TEST(ArcMotion, WithoutTurningIsAStraightLine) {
  const Pose2 motion = arc_motion(2.0, 0.5, 0.0, 3.0);
  EXPECT_DOUBLE_EQ(motion.x, 6.0);
  EXPECT_DOUBLE_EQ(motion.y, 1.5);
  EXPECT_DOUBLE_EQ(motion.heading, 0.0);
}

TEST(ArcMotion, SidewaysIsForwardsTurnedByAQuarter) {
  const Pose2 forwards = arc_motion(1.0, 0.0, 0.7, 2.0);
  const Pose2 sideways = arc_motion(0.0, 1.0, 0.7, 2.0);
  EXPECT_NEAR(sideways.x, -forwards.y, 1e-15);
  EXPECT_NEAR(sideways.y, forwards.x, 1e-15);
}

TEST(ArcMotion, SmallAnglesAgreeWithTheChord) {
  // The chord of an arc: length 2 r sin(a / 2), direction a / 2. On both sides of the switch to the
  // series.
  for (const double angle : {1e-9, 0.9e-4, 1.1e-4, 1e-2}) {
    const Pose2 motion = arc_motion(1.0, 0.0, angle, 1.0);
    EXPECT_NEAR(std::hypot(motion.x, motion.y), 2.0 / angle * std::sin(angle / 2.0), 1e-12);
    EXPECT_NEAR(std::atan2(motion.y, motion.x), angle / 2.0, 1e-12);
  }
}

TEST(Steer, SlowsByTheCosineOfTheHeadingError) {
  DriveOptions options;
  options.speed = 3.0;
  const Control ahead = steer(options, {0.0, 0.0, 0.0}, {5.0, 0.0});
  EXPECT_DOUBLE_EQ(ahead.speed, 3.0);
  EXPECT_DOUBLE_EQ(ahead.yaw_rate, 0.0);
  const Control left = steer(options, {0.0, 0.0, 0.0}, {1.0, std::sqrt(3.0)});  // 60 degrees left
  EXPECT_NEAR(left.speed, 1.5, 1e-12);
  EXPECT_NEAR(left.yaw_rate, 2.0 * kPi / 3.0 > 2.09 ? 2.09 : 2.0 * kPi / 3.0, 1e-12);
}

TEST(Steer, KeepsTheFloorAndTheLimit) {
  DriveOptions options;
  options.speed = 2.0;
  const Control right =
      steer(options, {0.0, 0.0, 0.0}, {-1.0, -0.1});  // nearly behind, to the right
  EXPECT_DOUBLE_EQ(right.speed, 0.6);
  EXPECT_DOUBLE_EQ(right.yaw_rate, -2.09);
}

TEST(Steer, TurnsTheShortWayRound) {
  const Control control = steer(DriveOptions(), {0.0, 0.0, 3.0}, {-1.0, -0.1});
  EXPECT_GT(control.yaw_rate, 0.0);  // across pi
}

TEST(Driver, ReachesTheWaypointsInOrderAndStops) {
  World world;
  world.waypoints = {{0.0, 0.0}, {10.0, 0.0}, {10.0, 10.0}, {0.0, 10.0}};
  Driver driver(world);
  Pose2 pose;
  int reached = -1;
  int steps = 0;
  for (; steps < 1000 && !driver.finished(); ++steps) {
    const int before = driver.target();
    const Pose2 at = pose;
    const Control control = driver.next_control(pose);
    if (driver.target() != before || driver.finished()) {
      ++reached;
      const Eigen::Vector2d& waypoint = world.waypoints[static_cast<std::size_t>(reached)];
      EXPECT_LT(std::hypot(at.x - waypoint.x(), at.y - waypoint.y()), world.drive.reached_distance);
    }
    pose = compose(pose, arc_motion(control.speed, 0.0, control.yaw_rate, 0.1));
  }
  EXPECT_TRUE(driver.finished());
  EXPECT_EQ(reached, 3);
  // 30 m along the way-points at 1 m/s at most; corners cost time and cut distance.
  EXPECT_GT(steps, 200);
  EXPECT_LT(steps, 400);
  EXPECT_EQ(driver.next_control(pose).speed, 0.0);
}

TEST(Driver, GoesRoundWhenTheWorldRepeats) {
  World world;
  world.repeat = true;
  world.waypoints = {{10.0, 0.0}, {10.0, 10.0}, {0.0, 10.0}, {0.0, 0.0}};
  Driver driver(world);
  Pose2 pose;
  for (int step = 0; step < 2000; ++step) {
    const Control control = driver.next_control(pose);
    pose = compose(pose, arc_motion(control.speed, 0.0, control.yaw_rate, 0.1));
    ASSERT_GT(pose.x, -2.0);
    ASSERT_LT(pose.x, 12.0);
    ASSERT_GT(pose.y, -2.0);
    ASSERT_LT(pose.y, 12.0);
  }
  EXPECT_FALSE(driver.finished());
  EXPECT_GT(driver.target(), 4 * 4);  // more than four laps of at most 40 m in 200 s
}

}  // namespace
}  // namespace pf_resampling
