// What BeaconMclPipeline does with messages that it cannot use.
#include <gtest/gtest.h>

#include <limits>

#include "beacon_mcl_rig.hpp"

namespace pf_resampling {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kStart = BeaconMclDrive::kStart;

/// A bad message, put in after 12 s of the drive, and what has to be counted.
struct BadMessage {
  std::string name;
  BeaconMclMessage message;
  std::string input;
  RejectReason reason;
};

ros::Time now() {
  return ros::Time(kStart + 12.0);
}

template <typename Change>
BadMessage bad_range(const std::string& name, RejectReason reason, Change change) {
  // Fresher than the filter's last range (11.84 s), covered by odometry.
  BeaconRange range = BeaconMclDrive::range(now() - ros::Duration(0.01), 1);
  change(&range);
  return {name, boost::make_shared<BeaconRange>(range), "ranges", reason};
}

template <typename Change>
BadMessage bad_odometry(const std::string& name, RejectReason reason, Change change) {
  nav_msgs::Odometry odometry = BeaconMclDrive::odometry(now() + ros::Duration(0.05));
  change(&odometry);
  return {name, boost::make_shared<nav_msgs::Odometry>(odometry), "odom", reason};
}

template <typename Change>
BadMessage bad_beacons(const std::string& name, RejectReason reason, Change change) {
  BeaconArray beacons = BeaconMclDrive::beacon_array();
  beacons.beacons[0].position.x += 1.0;
  change(&beacons);
  return {name, boost::make_shared<BeaconArray>(beacons), "beacons", reason};
}

template <typename Change>
BadMessage bad_initial_pose(const std::string& name, RejectReason reason, Change change) {
  geometry_msgs::PoseWithCovarianceStamped pose;
  pose.header.stamp = now();
  pose.header.frame_id = "map";
  pose.pose.pose.orientation.w = 1.0;
  change(&pose);
  return {name, boost::make_shared<geometry_msgs::PoseWithCovarianceStamped>(pose), "initialpose",
          reason};
}

BadMessage bad_transform(const std::string& name, double x, double quaternion_w) {
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = "base_link";
  transform.child_frame_id = "mast";
  transform.transform.translation.x = x;
  transform.transform.rotation.w = quaternion_w;
  tf2_msgs::TFMessage message;
  message.transforms.push_back(transform);
  return {name, boost::make_shared<tf2_msgs::TFMessage>(message), "tf", RejectReason::not_finite};
}

std::vector<BadMessage> bad_messages() {
  using R = RejectReason;
  std::vector<BadMessage> bad;
  bad.push_back(bad_range("NaN", R::not_finite, [](auto* m) { m->range = kNan; }));
  bad.push_back(bad_range("infinite", R::not_finite, [](auto* m) { m->range = kInfinity; }));
  bad.push_back(bad_range("zero", R::not_positive, [](auto* m) { m->range = 0.0; }));
  bad.push_back(bad_range("negative", R::not_positive, [](auto* m) { m->range = -3.0; }));
  bad.push_back(bad_range("NaN variance", R::not_finite, [](auto* m) { m->variance = kNan; }));
  bad.push_back(
      bad_range("infinite variance", R::not_finite, [](auto* m) { m->variance = kInfinity; }));
  bad.push_back(
      bad_range("negative variance", R::impossible_variance, [](auto* m) { m->variance = -0.01; }));
  bad.push_back(bad_range("unknown id", R::unknown_beacon, [](auto* m) { m->beacon = 99; }));
  bad.push_back(bad_range("unknown frame", R::unknown_frame,
                          [](auto* m) { m->header.frame_id = "somewhere"; }));
  bad.push_back(bad_range("no stamp", R::no_stamp, [](auto* m) { m->header.stamp = ros::Time(); }));
  bad.push_back(bad_range("old", R::old, [](auto* m) { m->header.stamp -= ros::Duration(3.0); }));
  bad.push_back(bad_range("far ahead", R::ahead_of_odometry,
                          [](auto* m) { m->header.stamp += ros::Duration(1e6); }));
  bad.push_back(bad_range("before the start", R::before_odometry,
                          [](auto* m) { m->header.stamp -= ros::Duration(50.0); }));

  bad.push_back(
      bad_odometry("NaN position", R::not_finite, [](auto* m) { m->pose.pose.position.x = kNan; }));
  bad.push_back(bad_odometry("infinite position", R::not_finite,
                             [](auto* m) { m->pose.pose.position.y = kInfinity; }));
  bad.push_back(bad_odometry("NaN orientation", R::not_finite,
                             [](auto* m) { m->pose.pose.orientation.w = kNan; }));
  bad.push_back(bad_odometry("no orientation", R::not_unit_quaternion, [](auto* m) {
    m->pose.pose.orientation = geometry_msgs::Quaternion();
  }));
  bad.push_back(bad_odometry("long quaternion", R::not_unit_quaternion,
                             [](auto* m) { m->pose.pose.orientation.w = 2.0; }));
  bad.push_back(
      bad_odometry("wrong frame", R::wrong_frame, [](auto* m) { m->header.frame_id = "world"; }));
  bad.push_back(bad_odometry("wrong child frame", R::wrong_frame,
                             [](auto* m) { m->child_frame_id = "wheel"; }));
  bad.push_back(
      bad_odometry("NaN covariance", R::not_finite, [](auto* m) { m->pose.covariance[7] = kNan; }));
  bad.push_back(bad_odometry("negative covariance", R::impossible_variance,
                             [](auto* m) { m->pose.covariance[0] = -1.0; }));
  bad.push_back(bad_odometry("crooked covariance", R::impossible_variance,
                             [](auto* m) { m->pose.covariance[1] = 1.0; }));
  bad.push_back(
      bad_odometry("no stamp", R::no_stamp, [](auto* m) { m->header.stamp = ros::Time(); }));
  bad.push_back(bad_odometry("again", R::out_of_order, [](auto* m) { m->header.stamp = now(); }));
  bad.push_back(bad_odometry("late", R::out_of_order,
                             [](auto* m) { m->header.stamp -= ros::Duration(0.3); }));
  bad.push_back(bad_odometry("from the past", R::time_jump,
                             [](auto* m) { m->header.stamp -= ros::Duration(60.0); }));
  bad.push_back(bad_odometry("from the future", R::time_gap,
                             [](auto* m) { m->header.stamp += ros::Duration(60.0); }));
  bad.push_back(
      bad_odometry("jumping", R::pose_jump, [](auto* m) { m->pose.pose.position.x += 100.0; }));
  bad.push_back(bad_odometry("at the end of the world", R::pose_jump,
                             [](auto* m) { m->pose.pose.position.x = 1e300; }));

  bad.push_back(bad_beacons("none", R::empty, [](auto* m) { m->beacons.clear(); }));
  bad.push_back(
      bad_beacons("NaN", R::not_finite, [](auto* m) { m->beacons[1].position.x = kNan; }));
  bad.push_back(bad_beacons("infinite height", R::not_finite,
                            [](auto* m) { m->beacons[1].position.z = kInfinity; }));
  bad.push_back(bad_beacons("twice", R::duplicate_beacon,
                            [](auto* m) { m->beacons[1].id = m->beacons[0].id; }));
  bad.push_back(
      bad_beacons("wrong frame", R::wrong_frame, [](auto* m) { m->header.frame_id = "odom"; }));

  bad.push_back(
      bad_initial_pose("NaN", R::not_finite, [](auto* m) { m->pose.pose.position.x = kNan; }));
  bad.push_back(bad_initial_pose("wrong frame", R::wrong_frame,
                                 [](auto* m) { m->header.frame_id = "odom"; }));
  bad.push_back(bad_initial_pose("no orientation", R::not_unit_quaternion,
                                 [](auto* m) { m->pose.pose.orientation.w = 0.0; }));
  bad.push_back(bad_initial_pose("negative covariance", R::impossible_variance,
                                 [](auto* m) { m->pose.covariance[35] = -0.1; }));
  bad.push_back(bad_initial_pose("infinite covariance", R::not_finite,
                                 [](auto* m) { m->pose.covariance[0] = kInfinity; }));

  bad.push_back(bad_transform("NaN", kNan, 1.0));
  bad.push_back(bad_transform("no rotation", 0.0, 0.0));
  return bad;
}

TEST(BeaconMclPipeline, ABadMessageIsCountedReportedAndChangesNothing) {
  const std::vector<BeaconMclMessage> drive = BeaconMclDrive::messages(20.0);
  Rig good;
  good.feed(drive);
  ASSERT_EQ(good.pipeline.rejects().total(), 0u);
  ASSERT_LT(good.error(), 0.5);

  // Up to and with the odometry of 12 s: 121 of them, 60 ranges, one array of beacons.
  const auto middle = drive.begin() + 1 + 121 + 60;
  for (const BadMessage& bad : bad_messages()) {
    SCOPED_TRACE(bad.input + ", " + bad.name);
    Rig run;
    run.feed({drive.begin(), middle});
    ASSERT_EQ(run.out.poses.back().header.stamp, now());
    const BeaconMclParticles before = run.pipeline.filter()->particles();
    const std::size_t poses = run.out.poses.size();
    handle(bad.message, &run.pipeline);
    EXPECT_TRUE(same_particles(before, run.pipeline.filter()->particles()));
    EXPECT_EQ(run.out.poses.size(), poses) << "it was answered with a pose";
    EXPECT_EQ(run.pipeline.rejects().count(bad.input, bad.reason), 1u);
    EXPECT_EQ(run.pipeline.rejects().total(), 1u);

    run.feed({middle, drive.end()});
    EXPECT_EQ(bytes_of_all(run.out.poses), bytes_of_all(good.out.poses));
    const FilterStatus& status = run.out.statuses.back();
    ASSERT_EQ(status.rejects.size(), 1u);
    EXPECT_EQ(status.rejects[0].input, bad.input);
    EXPECT_EQ(status.rejects[0].reason, to_string(bad.reason));
    EXPECT_EQ(status.rejects[0].count, 1u);
    const std::string key = "rejected " + bad.input + " " + to_string(bad.reason);
    EXPECT_EQ(value_of(run.out.diagnostics.back(), key).substr(0, 2), "1,");
    bool warned = false;
    for (const auto& diagnostics : run.out.diagnostics) {
      warned = warned ||
               (diagnostics.status[1].level == diagnostic_msgs::DiagnosticStatus::WARN &&
                diagnostics.status[1].message.find("1 messages rejected") != std::string::npos);
    }
    EXPECT_TRUE(warned);
    ASSERT_EQ(run.out.log.size(), 1u);
    EXPECT_NE(run.out.log[0].find(to_string(bad.reason)), std::string::npos);
  }
}

TEST(BeaconMclPipeline, NothingThatIsNotFiniteIsPublishedWhateverComes) {
  // Absurd but finite numbers pass the checks of messages: what comes out has to be finite.
  for (const double absurd : {1e-300, 1e-9, 1e9, 1e30, 1e160, 1.7e308}) {
    SCOPED_TRACE(absurd);
    Rig run;
    const auto drive = BeaconMclDrive::messages(6.0);
    int count = 0;
    for (const BeaconMclMessage& message : drive) {
      handle(message, &run.pipeline);
      if (++count % 7 == 0) {
        BeaconRange range = BeaconMclDrive::range(
            run.out.poses.empty() ? ros::Time(kStart) : run.out.poses.back().header.stamp, 2);
        range.range = absurd;
        run.pipeline.handle(range);
        range.range = 5.0;
        range.variance = absurd;
        run.pipeline.handle(range);
      }
    }
    EXPECT_TRUE(all_finite(run.out));

    geometry_msgs::PoseWithCovarianceStamped start;
    start.header.frame_id = "map";
    start.pose.pose.position.x = absurd;
    start.pose.pose.orientation.w = 1.0;
    for (const std::size_t i : {0u, 7u, 35u}) start.pose.covariance[i] = absurd;
    run.pipeline.handle(start);
    for (int i = 1; i < 40; ++i) {
      const ros::Time stamp(kStart + 6.0 + 0.1 * i);
      run.pipeline.handle(BeaconMclDrive::odometry(stamp));
      run.pipeline.handle(BeaconMclDrive::range(stamp, i % 4));
    }
    EXPECT_TRUE(all_finite(run.out));
  }
}

TEST(BeaconMclPipeline, WhatTheFilterRefusesIsRejectedAndTheOldBeaconsStay) {
  Rig run;
  run.feed(BeaconMclDrive::messages(6.0));
  const auto beacons = run.pipeline.filter()->beacons();
  const BeaconMclParticles particles = run.pipeline.filter()->particles();
  BeaconArray absurd = BeaconMclDrive::beacon_array();
  absurd.beacons.front().position.x = 1e200;
  run.pipeline.handle(absurd);
  EXPECT_EQ(run.pipeline.filter()->beacons().front().position, beacons.front().position);
  geometry_msgs::PoseWithCovarianceStamped start;
  start.header.frame_id = "map";
  start.pose.pose.position.x = 1e200;
  start.pose.pose.orientation.w = 1.0;
  run.pipeline.handle(start);
  EXPECT_TRUE((run.pipeline.filter()->particles().x == particles.x).all());
  EXPECT_EQ(run.pipeline.rejects().count("beacons", RejectReason::filter_error), 1u);
  EXPECT_EQ(run.pipeline.rejects().count("initialpose", RejectReason::filter_error), 1u);
}

}  // namespace
}  // namespace pf_resampling
