#include "src/odometry/dead_reckoning.hpp"
#include "pf_resampling_core/test/says.hpp"

#include <gtest/gtest.h>

#include "src/messages/conversions.hpp"

namespace pf_resampling {
namespace {

// Straight along x at 1 m/s, 10 messages a second, from 100 s on.
nav_msgs::Odometry message_at(double seconds) {
  nav_msgs::Odometry odometry;
  odometry.header.stamp = ros::Time(100.0 + seconds);
  odometry.header.frame_id = "odom";
  odometry.child_frame_id = "base_link";
  odometry.pose.pose = to_pose_message({seconds, 0.0, 0.0});
  return odometry;
}

struct ReckonedDrive {
  void until(double seconds) {
    for (; 0.1 * next <= seconds + 1e-9; ++next) odometry.take(message_at(0.1 * next), noise);
  }
  OdometryNoise noise;
  DeadReckoning odometry{OdometryBufferOptions()};
  int next = 0;
};

TEST(DeadReckoning, KeepsTheMotionThatTheFilterHasNotUsed) {
  ReckonedDrive drive;
  drive.until(2.0);
  EXPECT_NEAR(drive.odometry.since().mean.x, 2.0, 1e-9);
  EXPECT_NEAR(drive.odometry.until(ros::Time(100.75), drive.noise).mean.x, 0.75, 1e-9);
  drive.odometry.use_until(ros::Time(100.75), drive.noise);
  EXPECT_NEAR(drive.odometry.since().mean.x, 1.25, 1e-9);
  drive.until(3.0);
  EXPECT_NEAR(drive.odometry.since().mean.x, 2.25, 1e-9);
  drive.odometry.restart_at_oldest(drive.noise);
  EXPECT_NEAR(drive.odometry.since().mean.x, 3.0, 1e-9);
  // A stamp that odometry does not cover: from now on.
  drive.odometry.restart_at(ros::Time(500.0), drive.noise);
  EXPECT_NEAR(drive.odometry.since().mean.x, 0.0, 1e-9);
}

TEST(DeadReckoning, SaysWhichObservationsCannotBeUsed) {
  ReckonedDrive drive;
  drive.until(2.0);
  drive.odometry.use_until(ros::Time(101.0), drive.noise);
  EXPECT_EQ(drive.odometry.check_stamp(ros::Time(99.0), 0.0)->reason,
            RejectReason::before_odometry);
  EXPECT_EQ(drive.odometry.check_stamp(ros::Time(100.5), 0.1)->reason, RejectReason::old);
  EXPECT_FALSE(drive.odometry.check_stamp(ros::Time(100.95), 0.1));
  EXPECT_FALSE(drive.odometry.check_stamp(ros::Time(101.5), 0.0));
  EXPECT_FALSE(drive.odometry.check_ahead(ros::Time(102.5), 1.0));
  EXPECT_EQ(drive.odometry.check_ahead(ros::Time(104.0), 1.0)->reason,
            RejectReason::ahead_of_odometry);
}

// Half of the 30 s that are kept may go unused; then the filter is to follow until 7.5 s before
// now.
TEST(DeadReckoning, TellsWhenTheFilterHasToGoOnWithoutObservations) {
  ReckonedDrive drive;
  drive.until(14.9);
  EXPECT_FALSE(drive.odometry.overdue());
  drive.until(15.1);
  ASSERT_TRUE(drive.odometry.overdue());
  EXPECT_NEAR(drive.odometry.overdue()->toSec(), 115.1 - 7.5, 0.11);
}

TEST(DeadReckoning, TellsWhenMoreMessagesWaitThanAreKept) {
  DeadReckoning odometry{OdometryBufferOptions()};
  nav_msgs::Odometry message = message_at(0.0);
  for (std::size_t i = 1; i < OdometryBuffer::kMost; ++i) {
    odometry.take(message, {});
    message.header.stamp += ros::Duration(0, 1);
  }
  EXPECT_FALSE(odometry.overdue());
  odometry.take(message, {});
  ASSERT_TRUE(odometry.overdue());
  EXPECT_TRUE(odometry.covers(*odometry.overdue()));
  EXPECT_GT(*odometry.overdue(), odometry.used());
  odometry.use_until(*odometry.overdue(), {});
  EXPECT_FALSE(odometry.overdue());
}

TEST(DeadReckoning, StartsOverWhenTimeJumpsBack) {
  ReckonedDrive drive;
  drive.until(5.0);
  drive.odometry.use_until(ros::Time(104.0), drive.noise);
  for (const double time : {1.0, 1.1, 1.2, 1.3}) {
    EXPECT_EQ(drive.odometry.take(message_at(time), drive.noise).rejection->reason,
              RejectReason::time_jump);
  }
  const DeadReckoning::Taken taken = drive.odometry.take(message_at(1.4), drive.noise);
  EXPECT_TRUE(taken.time_jumped);
  EXPECT_TRUE(says(taken.warning, "time jumped back by 4.000 s"));
  EXPECT_EQ(drive.odometry.time_jumps(), 1u);
  EXPECT_EQ(drive.odometry.used(), ros::Time(101.0));
  EXPECT_NEAR(drive.odometry.since().mean.x, 0.4, 1e-9);
  EXPECT_EQ(drive.odometry.check_stamp(ros::Time(100.5), 0.0)->reason,
            RejectReason::before_odometry);
}

// A clock that is told the time: the robot is where it was, whatever the clock says.
TEST(DeadReckoning, StartsOverWhenTimeJumpsForward) {
  ReckonedDrive drive;
  drive.until(5.0);
  drive.odometry.use_until(ros::Time(104.0), drive.noise);
  for (const double time : {1e9, 1e9 + 0.1, 1e9 + 0.2, 1e9 + 0.3}) {
    EXPECT_EQ(drive.odometry.take(message_at(time), drive.noise).rejection->reason,
              RejectReason::time_jump);
  }
  const DeadReckoning::Taken taken = drive.odometry.take(message_at(1e9 + 0.4), drive.noise);
  EXPECT_TRUE(taken.time_jumped);
  EXPECT_FALSE(taken.began_again);
  EXPECT_EQ(drive.odometry.time_jumps(), 0u) << "these are told of as jumps back";
  EXPECT_EQ(taken.warning.rfind("time jumped forward by 999999995.", 0), 0u) << taken.warning;
  EXPECT_NEAR(taken.until_jump.mean.x, 1.0, 1e-9);
  EXPECT_NEAR(drive.odometry.since().mean.x, 0.4, 1e-6);
  EXPECT_LT(drive.odometry.since().duration, 1.0);
}

// Until somebody has used it, odometry is kept; but not for ever.
TEST(DeadReckoning, KeepsWhatTheFilterHasYetToUse) {
  ReckonedDrive drive;
  drive.until(60.0);
  drive.odometry.use_until(ros::Time(160.0), drive.noise);
  drive.until(60.5);
  drive.odometry.restart_at_oldest(drive.noise);
  const ros::Time oldest = drive.odometry.used();
  EXPECT_NEAR(oldest.toSec(), 130.0, 0.6);
  drive.until(70.0);
  EXPECT_TRUE(drive.odometry.covers(oldest));
  drive.odometry.use_until(ros::Time(170.0), drive.noise);
  drive.until(70.5);
  EXPECT_FALSE(drive.odometry.covers(oldest));
}

TEST(MovedBy, MovesRigidlyAndGrowsTheCovariance) {
  PoseEstimate estimate;
  estimate.mean = {1.0, 2.0, kPi / 2};
  estimate.covariance = Eigen::Vector3d(0.1, 0.2, 0.03).asDiagonal();
  OdometryIncrement motion;
  motion.mean = {2.0, 0.0, 0.1};
  motion.covariance = Eigen::Vector3d(0.01, 0.02, 0.001).asDiagonal();
  motion.yaw_rate_sensitivity = {0.0, 0.5, 1.0};
  const PoseEstimate moved = moved_by(estimate, without_yaw_rate_bias(motion, 0.02, 0.1));
  // Dead reckoning turned too much by the bias: 0.02 * (0, 0.5, 1) is taken out.
  EXPECT_NEAR(moved.mean.x, 1.0 + 0.01, 1e-12);
  EXPECT_NEAR(moved.mean.y, 4.0, 1e-12);
  EXPECT_NEAR(moved.mean.heading, kPi / 2 + 0.08, 1e-12);
  // Facing along y: body x is map y, body y is map -x. The lever arm of 2 m carries the heading's
  // variance into x: 4 * 0.03.
  EXPECT_NEAR(moved.covariance(0, 0), 0.1 + 4.0 * 0.03 + 0.02 + 0.25 * 0.01, 1e-9);
  EXPECT_NEAR(moved.covariance(1, 1), 0.2 + 1e-4 * 0.03 + 0.01, 1e-9);
  EXPECT_NEAR(moved.covariance(2, 2), 0.03 + 0.001 + 0.01, 1e-12);
}

}  // namespace
}  // namespace pf_resampling
