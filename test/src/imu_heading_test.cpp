#include "src/odometry/imu_heading.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "pf_resampling_core/geometry.hpp"
#include "src/messages/conversions.hpp"

namespace pf_resampling {
namespace {

sensor_msgs::Imu turning(double time, double rate) {
  sensor_msgs::Imu imu;
  imu.header.stamp = ros::Time(time);
  imu.header.frame_id = "base_link";
  imu.angular_velocity.z = rate;
  imu.orientation_covariance[0] = -1.0;
  return imu;
}

sensor_msgs::Imu pointing(double time, double yaw) {
  sensor_msgs::Imu imu = turning(time, 0.0);
  imu.orientation = to_quaternion_message(yaw);
  imu.orientation_covariance[0] = 0.0;
  return imu;
}

TEST(ImuHeading, IntegratesTheYawRate) {
  ImuHeading heading(ImuUse::yaw_rate);
  const StaticFrames frames;
  EXPECT_FALSE(heading.at(ros::Time(10.0)));
  EXPECT_FALSE(heading.take(turning(10.0, 0.5), "base_link", frames));
  EXPECT_FALSE(heading.at(ros::Time(10.0)));  // the first has no zero yet
  const double zero = heading.at(ros::Time(10.0)).value();
  for (int i = 1; i <= 20; ++i) {
    EXPECT_FALSE(heading.take(turning(10.0 + 0.1 * i, 0.5), "base_link", frames));
  }
  EXPECT_NEAR(wrap_angle(heading.at(ros::Time(12.0)).value() - zero), 1.0, 1e-6);
  // A little before and beyond the newest message; not far beyond.
  EXPECT_NEAR(wrap_angle(heading.at(ros::Time(12.1)).value() - zero), 1.05, 1e-6);
  EXPECT_NEAR(wrap_angle(heading.at(ros::Time(11.9)).value() - zero), 0.95, 1e-6);
  EXPECT_FALSE(heading.at(ros::Time(12.5)));
}

TEST(ImuHeading, MeansTheTurnOfTheRobotHoweverItIsMounted) {
  ImuHeading heading(ImuUse::yaw_rate);
  StaticFrames frames;
  geometry_msgs::TransformStamped mounted;
  mounted.header.frame_id = "base_link";
  mounted.child_frame_id = "imu";
  mounted.transform.rotation.x = 1.0;  // upside down
  ASSERT_TRUE(frames.add(mounted));
  for (int i = 0; i <= 10; ++i) {
    sensor_msgs::Imu imu = turning(10.0 + 0.1 * i, -1.0);
    imu.header.frame_id = "imu";
    EXPECT_FALSE(heading.take(imu, "base_link", frames));
    if (i == 0) heading.at(ros::Time(10.0));
  }
  EXPECT_NEAR(heading.at(ros::Time(11.0)).value(), 1.0, 1e-6);
  sensor_msgs::Imu elsewhere = turning(11.1, 0.0);
  elsewhere.header.frame_id = "other";
  EXPECT_EQ(heading.take(elsewhere, "base_link", frames)->reason, RejectReason::unknown_frame);
}

TEST(ImuHeading, ReadsTheOrientation) {
  ImuHeading heading(ImuUse::orientation);
  StaticFrames frames;
  geometry_msgs::TransformStamped mounted;
  mounted.header.frame_id = "base_link";
  mounted.child_frame_id = "imu";
  mounted.transform.rotation = to_quaternion_message(0.5 * kPi);  // x points left
  ASSERT_TRUE(frames.add(mounted));
  sensor_msgs::Imu imu = pointing(10.0, 0.3);
  imu.header.frame_id = "imu";
  EXPECT_FALSE(heading.take(imu, "base_link", frames));
  EXPECT_NEAR(heading.at(ros::Time(10.0)).value(), 0.3 - 0.5 * kPi, 1e-9);
  imu = pointing(10.1, 0.3);
  imu.orientation.w = 3.0;
  EXPECT_EQ(heading.take(imu, "base_link", frames)->reason, RejectReason::not_unit_quaternion);
}

TEST(ImuHeading, SaysNothingAfterASilence) {
  ImuHeading heading(ImuUse::yaw_rate);
  const StaticFrames frames;
  for (const double time : {10.0, 10.1}) heading.take(turning(time, 1.0), "base_link", frames);
  heading.at(ros::Time(10.1));
  ASSERT_TRUE(heading.at(ros::Time(10.1)));
  heading.take(turning(11.0, 1.0), "base_link", frames);
  EXPECT_FALSE(heading.at(ros::Time(11.0)));
  EXPECT_TRUE(heading.at(ros::Time(11.0)));
}

TEST(ImuHeading, TakesNothingThatMakesNoSense) {
  const StaticFrames frames;
  ImuHeading none;
  none.take(turning(10.0, 1.0), "base_link", frames);
  EXPECT_FALSE(none.at(ros::Time(10.0)));
  // It says that it has no rate (REP 145).
  ImuHeading heading(ImuUse::yaw_rate);
  sensor_msgs::Imu without = turning(10.0, 1.0);
  without.angular_velocity_covariance[0] = -1.0;
  EXPECT_FALSE(heading.take(without, "base_link", frames));
  EXPECT_FALSE(heading.at(ros::Time(10.0)));
  EXPECT_FALSE(heading.at(ros::Time(10.0)));
  heading.take(turning(10.0, 0.0), "base_link", frames);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(heading.take(turning(10.1, nan), "base_link", frames)->reason,
            RejectReason::not_finite);
  EXPECT_EQ(heading.take(turning(10.1, 1000.0), "base_link", frames)->reason,
            RejectReason::impossible_range);
  EXPECT_EQ(heading.take(turning(9.9, 0.0), "base_link", frames)->reason,
            RejectReason::out_of_order);
  EXPECT_EQ(heading.take(turning(0.0, 0.0), "base_link", frames)->reason, RejectReason::no_stamp);
}

}  // namespace
}  // namespace pf_resampling
