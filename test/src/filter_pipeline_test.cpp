// What the pipelines of both filters do alike.
#include "src/pipeline/filter_pipeline.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "src/pipeline/belief_publisher.hpp"
#include "test/bag_topics.hpp"
#include "test/beacon_mcl_rig.hpp"
#include "test/fastslam_rig.hpp"

namespace pf_resampling {
namespace {

template <typename AnyRig>
class FilterPipelineOf : public testing::Test {};
using Rigs = testing::Types<Rig, FastSlamRig>;
TYPED_TEST_SUITE(FilterPipelineOf, Rigs);

// ---- what comes out ---------------------------------------------------------------------------

// A robot drives on in the time between the two: the arrow of the pose would trail its particles.
TYPED_TEST(FilterPipelineOf, PoseMarkersAndCloudsAreOfTheSameTimes) {
  auto options = TypeParam::Drive::options();
  options.output.cloud_period = 0.5;
  options.output.marker_period = 0.5;
  TypeParam run(options);
  int odometry = 0;
  for (const auto& message : TypeParam::Drive::messages(15.0)) {
    if (TypeParam::is_odometry(message)) ++odometry;
    // The belief does not begin at a multiple of the periods.
    if (odometry > 13 || !TypeParam::is_observation(message)) handle(message, &run.pipeline);
  }
  int arrows = 0;
  for (const auto& array : run.out.markers) {
    for (const auto& marker : array.markers) {
      if (marker.ns != "pose_heading") continue;
      ++arrows;
      EXPECT_TRUE(
          std::any_of(run.out.pose_arrays.begin(), run.out.pose_arrays.end(),
                      [&](const auto& cloud) { return cloud.header.stamp == marker.header.stamp; }))
          << marker.header.stamp;
    }
  }
  EXPECT_GT(arrows, 10);
}

TYPED_TEST(FilterPipelineOf, PicturesComeAtTheirPeriods) {
  auto options = TypeParam::Drive::options();
  options.output.cloud_period = 0.5;
  options.output.marker_period = 1.0;
  options.output.diagnostics_period = 2.0;
  TypeParam run(options);
  run.feed(TypeParam::Drive::messages(20.0));
  const double believed = 0.1 * static_cast<double>(run.out.poses.size() - 1);
  EXPECT_NEAR(static_cast<double>(run.out.clouds.size()), believed / 0.5 + 1.0, 1.0);
  EXPECT_EQ(run.out.clouds.size(), run.out.pose_arrays.size());
  EXPECT_EQ(run.out.markers.size(), 21u);
  EXPECT_EQ(run.out.diagnostics.size(), 11u);

  // The cloud: weights add up to one, and its weighted mean is the pose.
  const sensor_msgs::PointCloud2& cloud = run.out.clouds.back();
  ASSERT_EQ(cloud.width, static_cast<std::uint32_t>(run.particles().size()));
  ASSERT_EQ(cloud.fields.size(), 6u);
  EXPECT_EQ(cloud.fields[4].name, "weight");
  EXPECT_EQ(cloud.fields[5].name, "ancestor");
  const auto pose =
      std::find_if(run.out.poses.begin(), run.out.poses.end(),
                   [&](const auto& other) { return other.header.stamp == cloud.header.stamp; });
  ASSERT_NE(pose, run.out.poses.end());
  EXPECT_NEAR(mean_x_of(cloud), pose->pose.pose.position.x, 0.05);
}

TEST(IsDue, AtTheMultiplesOfThePeriodWhereverItBegan) {
  ros::Time last;
  const auto due = [&](double stamp) { return is_due(0.5, ros::Time(stamp), &last); };
  EXPECT_TRUE(due(100.3));
  EXPECT_FALSE(due(100.49));
  EXPECT_TRUE(due(100.49999));  // 100.5, rounded
  EXPECT_FALSE(due(100.50001));
  EXPECT_FALSE(due(100.9));
  EXPECT_TRUE(due(101.2));
  EXPECT_TRUE(due(101.5));
  EXPECT_TRUE(due(101.4));  // time went back
  EXPECT_TRUE(due(107.0));
  for (const double stamp : {107.0, 107.1}) {
    EXPECT_TRUE(is_due(0.0, ros::Time(stamp), &last)) << "each";
  }
}

// A robot whose sensors fall silent drives on: health follows what it still knows, in `status`,
// too.
TYPED_TEST(FilterPipelineOf, StatusGoesOnWhenObservationsStop) {
  auto options = TypeParam::Drive::options();
  options.filter.odometry.heading_per_distance = 0.3;
  TypeParam run(options);
  run.feed(TypeParam::Drive::messages(15.0));
  const std::size_t updates = run.out.statuses.size();
  EXPECT_EQ(run.out.statuses.back().health, "healthy");
  ros::Time crossed;
  for (int i = 1; i <= 600; ++i) {
    const ros::Time now = TypeParam::Drive::at(15.0 + 0.1 * i);
    run.pipeline.handle(TypeParam::Drive::odometry(now));
    if (crossed.isZero() && run.pipeline.health().health != Health::healthy) crossed = now;
  }
  ASSERT_FALSE(crossed.isZero());
  ASSERT_GT(run.out.statuses.size(), updates);
  for (std::size_t i = updates; i < run.out.statuses.size(); ++i) {
    const FilterStatus& status = run.out.statuses[i];
    EXPECT_LT((status.header.stamp - run.out.statuses[i - 1].header.stamp).toSec(), 1.15);
    EXPECT_EQ(status.health, status.header.stamp < crossed ? "healthy" : "converging");
  }
  // And when odometry stops as well.
  const std::size_t before = run.out.statuses.size();
  for (int i = 1; i <= 5; ++i) run.pipeline.report_silence(TypeParam::Drive::at(75.0 + i));
  EXPECT_EQ(run.out.statuses.size(), before + 5);
}

// ---- where odometry comes from ----------------------------------------------------------------

TYPED_TEST(FilterPipelineOf, OdometryMayComeAsATransform) {
  const auto drive = TypeParam::Drive::messages(15.0);
  auto options = TypeParam::Drive::options();
  options.odometry_input.use_covariance = false;  // a transform has none
  TypeParam by_topic(options);
  by_topic.feed(drive);
  options.odometry_input.source = OdometrySource::tf;
  TypeParam deaf(options);
  deaf.feed(drive);
  EXPECT_TRUE(deaf.out.poses.empty());  // the topic is not heard
  TypeParam by_tf(options);
  for (const auto& message : drive) {
    if (!TypeParam::is_odometry(message)) {
      handle(message, &by_tf.pipeline);
      continue;
    }
    dispatch(as_transform(*std::get<nav_msgs::Odometry::ConstPtr>(message)), &by_tf.pipeline);
  }
  ASSERT_EQ(by_tf.out.poses.size(), by_topic.out.poses.size());
  EXPECT_EQ(by_tf.pose().x, by_topic.pose().x);
  EXPECT_EQ(by_tf.pose().heading, by_topic.pose().heading);
}

// A node says so where nobody publishes the topic.
TYPED_TEST(FilterPipelineOf, SaysThatATransformCouldBeTheOdometry) {
  auto options = TypeParam::Drive::options();
  TypeParam run(options);
  tf2_msgs::TFMessage tf;
  tf.transforms.emplace_back();
  geometry_msgs::TransformStamped& transform = tf.transforms.front();
  transform.header.frame_id = "/" + options.frames.odom;
  transform.child_frame_id = "camera";
  transform.transform.rotation.w = 1.0;
  dispatch(tf, &run.pipeline);
  EXPECT_EQ(run.pipeline.odometry_elsewhere(), "");
  transform.child_frame_id = options.frames.base;
  dispatch(tf, &run.pipeline);
  EXPECT_EQ(run.pipeline.odometry_elsewhere(),
            "'odom' -> 'base_link' on /tf could be it: set odometry_input/source to tf");
  EXPECT_STREQ(run.pipeline.odometry_input(), "odom");
  options.odometry_input.source = OdometrySource::tf;
  TypeParam by_tf(options);
  dispatch(tf, &by_tf.pipeline);
  EXPECT_EQ(by_tf.pipeline.odometry_elsewhere(), "");
  EXPECT_STREQ(by_tf.pipeline.odometry_input(), "/tf");
}

// Wheels that do not see the turns at all, and an IMU that does.
TYPED_TEST(FilterPipelineOf, TheImuSaysHowTheRobotTurns) {
  auto options = TypeParam::Drive::options();
  options.odometry_input.imu_heading = ImuUse::orientation;
  TypeParam run(options);
  double length = 0.0;
  std::optional<Pose2> before;
  for (const auto& message : TypeParam::Drive::messages(15.0)) {
    if (!TypeParam::is_odometry(message)) {
      handle(message, &run.pipeline);
      continue;
    }
    nav_msgs::Odometry odometry = *std::get<nav_msgs::Odometry::ConstPtr>(message);
    const Pose2 pose = to_pose2(odometry.pose.pose);
    sensor_msgs::Imu imu;
    imu.header.stamp = odometry.header.stamp;
    imu.header.frame_id = odometry.child_frame_id;
    imu.orientation = odometry.pose.pose.orientation;
    dispatch(imu, &run.pipeline);
    if (before) length += distance(*before, pose);
    before = pose;
    odometry.pose.pose = to_pose_message({length, 0.0, 0.0});
    dispatch(odometry, &run.pipeline);
  }
  EXPECT_EQ(run.pipeline.rejects().count("imu", RejectReason::unknown_frame), 0u);
  EXPECT_LT(run.error(), kLost);
  // map -> odom goes with the odometry as it came, which tf has, too.
  const auto& transform = run.out.transforms.back().transform;
  const Pose2 odom = {transform.translation.x, transform.translation.y, yaw_of(transform.rotation)};
  EXPECT_LT(distance(compose(odom, {length, 0.0, 0.0}), run.pose()), 1e-6);
}

TYPED_TEST(FilterPipelineOf, LeavesTheTransformToOthers) {
  auto options = TypeParam::Drive::options();
  options.frames.publish_tf = false;
  TypeParam run(options);
  run.feed(TypeParam::Drive::messages(5.0));
  EXPECT_FALSE(run.out.poses.empty());
  EXPECT_TRUE(run.out.transforms.empty());
}

// ---- time -------------------------------------------------------------------------------------

TYPED_TEST(FilterPipelineOf, ObservationsWaitForOdometryAndAreUsedInOrderOfTime) {
  const auto drive = TypeParam::Drive::messages(15.0);
  TypeParam in_order;
  in_order.feed(drive);

  // The same, but all observations of a second come before its odometry, the newest first. Poses
  // at stamps after the last observation have to be the same.
  TypeParam early;
  std::vector<typename TypeParam::Message> odometry, observations;
  int waited = 0;
  const auto flush = [&] {
    early.feed({observations.rbegin(), observations.rend()});
    waited = std::max(waited, early.pipeline.queued());
    early.feed(odometry);
    observations.clear();
    odometry.clear();
  };
  for (const auto& message : drive) {
    if (TypeParam::is_odometry(message)) {
      odometry.push_back(message);
    } else if (TypeParam::is_observation(message)) {
      observations.push_back(message);
    } else {
      early.feed({message});
    }
    if (odometry.size() == 10) flush();
  }
  flush();
  EXPECT_GT(waited, 0);
  EXPECT_EQ(early.pipeline.rejects().total(), 0u);
  ASSERT_EQ(early.out.statuses.size(), in_order.out.statuses.size());
  for (std::size_t i = 0; i < early.out.statuses.size(); ++i) {
    EXPECT_EQ(early.out.statuses[i].header.stamp, in_order.out.statuses[i].header.stamp);
  }
  EXPECT_TRUE(same_particles(early.particles(), in_order.particles()));
  EXPECT_TRUE(bytes_of(early.out.poses.back()) == bytes_of(in_order.out.poses.back()));
}

TYPED_TEST(FilterPipelineOf, AnObservationWaitsUntilOdometryCoversItsStamp) {
  using Drive = typename TypeParam::Drive;
  TypeParam run;
  run.feed(Drive::messages(0.0, 0.0));  // one observation waits
  run.pipeline.handle(Drive::observation_at(Drive::at(0.15), 1));
  run.pipeline.handle(Drive::odometry(Drive::at(0.1)));
  EXPECT_EQ(run.pipeline.queued(), 1);
  EXPECT_EQ(run.out.statuses.size(), 1u);
  run.pipeline.handle(Drive::odometry(Drive::at(0.2)));
  EXPECT_EQ(run.pipeline.queued(), 0);
  ASSERT_EQ(run.out.statuses.size(), 2u);
  EXPECT_EQ(run.out.statuses[1].header.stamp, Drive::at(0.15));
}

TYPED_TEST(FilterPipelineOf, ObservationsThatComeTooLateAreCountedAndChangeNothing) {
  using Drive = typename TypeParam::Drive;
  const auto drive = Drive::messages(10.0);
  TypeParam good;
  good.feed(drive);
  TypeParam run;
  run.pipeline.handle(Drive::observation_at(Drive::at(-0.1), 0));
  for (std::size_t i = 0; i < drive.size(); ++i) {
    run.feed({drive[i]});
    if (i == 60) run.pipeline.handle(Drive::observation_at(Drive::at(2.0), 1));
  }
  EXPECT_EQ(run.rejected(TypeParam::kTopic, RejectReason::before_odometry), 1u);
  EXPECT_EQ(run.rejected(TypeParam::kTopic, RejectReason::old), 1u);
  EXPECT_EQ(run.pipeline.rejects().total(), 2u);
  EXPECT_TRUE(same_bytes(run.out.poses, good.out.poses));
}

TYPED_TEST(FilterPipelineOf, TheQueueIsBoundedAndDropsTheOldest) {
  using Drive = typename TypeParam::Drive;
  auto options = Drive::options();
  options.queue_length = 5;
  TypeParam run(options);
  run.feed(Drive::messages(0.0, 0.0));  // one observation waits
  for (int i = 1; i <= 20; ++i) {
    run.pipeline.handle(Drive::observation_at(Drive::at(0.1 * i), i));
    EXPECT_LE(run.pipeline.queued(), 5);
  }
  EXPECT_EQ(run.rejected(TypeParam::kTopic, RejectReason::queue_full), 16u);
  for (int i = 1; i <= 21; ++i) run.pipeline.handle(Drive::odometry(Drive::at(0.1 * i)));
  EXPECT_EQ(run.pipeline.queued(), 0);
  ASSERT_EQ(run.out.statuses.size(), 6u);  // the first after a second without any
  EXPECT_EQ(run.out.statuses[1].header.stamp, Drive::at(1.6));
}

// Computation that does not keep up: what waits is bounded, the oldest goes first and is counted,
// and the pose keeps coming.
TYPED_TEST(FilterPipelineOf, DropsTheOldestWhenItCannotKeepUp) {
  using Drive = typename TypeParam::Drive;
  auto options = Drive::options();
  options.deferred = true;
  options.max_latency = 1.0;
  TypeParam run(options);
  // 5 observations a second come, one is worked off.
  int processed = 0;
  int messages = 0;
  double largest_latency = 0.0;
  for (const auto& message : Drive::messages(60.0)) {
    run.feed({message});
    if (++messages % 15 == 0 && run.pipeline.process_next()) {
      ++processed;
      largest_latency = std::max(largest_latency, run.out.statuses.back().latency);
    }
  }
  const auto dropped = run.rejected(TypeParam::kTopic, RejectReason::overload);
  EXPECT_LT(largest_latency, 1.0 + 0.2);
  EXPECT_LE(run.pipeline.queued(), 7);
  EXPECT_EQ(processed + static_cast<int>(dropped) + run.pipeline.queued(), 301);
  EXPECT_GT(dropped, 200u);
  EXPECT_TRUE(says(said(run.out, ": timing"), "too slow"));
  EXPECT_LT(run.error(), 2.0 * kLost);
}

TYPED_TEST(FilterPipelineOf, TimeThatJumpsBackStartsAnewAndIsReported) {
  using Drive = typename TypeParam::Drive;
  const auto drive = Drive::messages(20.0);
  TypeParam run;
  run.feed(drive);
  const std::size_t updates = run.out.statuses.size();
  run.feed(drive);  // a bag that loops
  EXPECT_EQ(run.rejected("odom", RejectReason::time_jump), 4u);
  EXPECT_EQ(value_of(run.out.diagnostics.back(), "jumps back in time"), "1");
  EXPECT_TRUE(run.has_said("time jumped back by 20.0"));
  EXPECT_TRUE(run.has_said("the filter is reset"));
  EXPECT_EQ(run.out.poses.back().header.stamp, Drive::at(20.0));
  EXPECT_LT(run.error(), kLost);
  // The second round uses as many as the first, save those before its fifth odometry, which
  // confirms that time jumped.
  EXPECT_GE(run.out.statuses.size(), 2 * updates - 2);
}

TYPED_TEST(FilterPipelineOf, WithoutObservationsTheBeliefMovesOnByOdometry) {
  using Drive = typename TypeParam::Drive;
  TypeParam run;
  run.feed(Drive::messages(10.0));
  ASSERT_LT(run.error(), kLost);
  const Eigen::Matrix3d before = to_covariance3(run.out.poses.back().pose.covariance);
  const std::size_t poses = run.out.poses.size();
  // Four times as long as odometry is kept.
  for (int i = 101; i <= 1300; ++i) run.pipeline.handle(Drive::odometry(Drive::at(0.1 * i)));
  EXPECT_EQ(run.out.poses.size(), poses + 1200);
  const Eigen::Matrix3d after = to_covariance3(run.out.poses.back().pose.covariance);
  EXPECT_GT(after.trace(), 2.0 * before.trace());
  // Odometry is exact, but the particles drift as they believe it to; 4 of its own sigma.
  EXPECT_LT(run.error(), 4.0 * std::sqrt(after(0, 0) + after(1, 1)));
  EXPECT_TRUE(
      says(said(run.out, ": inputs"), std::string("no usable ") + TypeParam::kTopic + " for"));
  EXPECT_EQ(run.pipeline.rejects().total(), 0u);
}

// ---- what comes out ---------------------------------------------------------------------------

TYPED_TEST(FilterPipelineOf, ThePoseComesWithEveryOdometryAndAgreesWithTheTransform) {
  using Drive = typename TypeParam::Drive;
  TypeParam run;
  run.feed(Drive::messages(10.0));
  ASSERT_EQ(run.out.poses.size(), run.out.transforms.size());
  const std::size_t missing = 101 - run.out.poses.size();
  EXPECT_LT(missing, 10u);  // before the first ranges
  for (std::size_t i = 0; i < run.out.poses.size(); ++i) {
    const ros::Time stamp = run.out.poses[i].header.stamp;
    EXPECT_EQ(stamp, Drive::at(0.1 * static_cast<double>(i + missing)));
    EXPECT_EQ(run.out.poses[i].header.frame_id, "map");
    const auto& transform = run.out.transforms[i];
    EXPECT_NEAR((transform.header.stamp - stamp).toSec(),
                Drive::options().frames.transform_tolerance, 1e-9);
    EXPECT_EQ(transform.header.frame_id, "map");
    EXPECT_EQ(transform.child_frame_id, "odom");
    const Pose2 odom = {transform.transform.translation.x, transform.transform.translation.y,
                        yaw_of(transform.transform.rotation)};
    const Pose2 base = compose(odom, to_pose2(Drive::odometry(stamp).pose.pose));
    const Pose2 pose = to_pose2(run.out.poses[i].pose.pose);
    EXPECT_NEAR(base.x, pose.x, 1e-9);
    EXPECT_NEAR(base.y, pose.y, 1e-9);
    EXPECT_NEAR(wrap_angle(base.heading - pose.heading), 0.0, 1e-9);
  }
}

TYPED_TEST(FilterPipelineOf, ThereIsNoBeliefWithoutOdometry) {
  using Drive = typename TypeParam::Drive;
  TypeParam run;
  run.pipeline.handle(initial_pose(Drive::at(0.0), {1.0, 2.0, 0.5}));
  const auto drive = Drive::messages(0.0, 0.0);
  for (const auto& message : drive) {
    if (TypeParam::is_odometry(message)) break;
    run.feed({message});
  }
  EXPECT_FALSE(run.pipeline.estimate());
  EXPECT_EQ(run.pipeline.lost_probability(), 1.0);
  EXPECT_FALSE(run.pipeline.checkpoint());
  run.pipeline.report_silence(Drive::at(0.0));
  EXPECT_TRUE(says(run.out.diagnostics.back().status[0].message, "waiting for odometry"));
  run.pipeline.handle(Drive::odometry(Drive::at(0.0)));
  ASSERT_TRUE(run.pipeline.estimate());
  // The mean of 60 particles or more of sigma 0.1 is off by 0.013 m; six times that.
  EXPECT_NEAR(run.pipeline.estimate()->mean.x, 1.0, 0.08);
  EXPECT_LT(run.pipeline.lost_probability(), kLikelyLost);
}

TYPED_TEST(FilterPipelineOf, DiagnosticsOfAFilterThatIsRightSayFine) {
  TypeParam run;
  run.feed(TypeParam::Drive::messages(20.0));
  EXPECT_EQ(run.out.diagnostics.back().status[0].message, "fine");
  EXPECT_EQ(said(run.out, ": inputs"), "fine");
}

// Put elsewhere by hand, with recovery switched off while it runs: it says that it is lost.
TYPED_TEST(FilterPipelineOf, WithRecoverySwitchedOffWhileItRunsItStaysLostAndSaysSo) {
  using Drive = typename TypeParam::Drive;
  TypeParam run;
  run.feed(Drive::messages(0.0, 20.0));
  EXPECT_LT(run.out.statuses.back().lost, 0.05);
  run.pipeline.set_parameters({{"recovery/enabled", "false"}});
  run.pipeline.handle(initial_pose(Drive::at(20.0), {-20.0, 15.0, 0.0}));
  run.feed(Drive::messages(20.1, 25.0));
  EXPECT_EQ(run.out.statuses.back().injected, 0u);
  EXPECT_GT(run.out.statuses.back().lost, 0.9);
  EXPECT_GT(run.out.statuses.back().normalized_innovation, 6.0);
  EXPECT_TRUE(says(run.out.diagnostics.back().status[0].message, "lost?"));
}

// One is the usual case, and it is the pose.
TYPED_TEST(FilterPipelineOf, AFilterThatIsRightHasOneHypothesis) {
  TypeParam run;
  run.feed(TypeParam::Drive::messages(20.0));
  const FilterStatus& status = run.out.statuses.back();
  ASSERT_EQ(status.hypotheses.size(), 1u);
  EXPECT_GT(status.hypotheses[0].weight, 0.9);
  EXPECT_NEAR(status.hypotheses[0].weight + status.other_weight, 1.0, 1e-9);
  const Pose2 truth = TypeParam::Drive::truth(status.header.stamp);
  EXPECT_LT(distance(to_pose2(status.hypotheses[0].pose.pose), truth), kLost);
  EXPECT_FALSE(says(status.health_text, "places fit"));
  EXPECT_TRUE(markers_called(run.out.markers.back(), "hypotheses").empty());
}

// Those of many particles are looked for once a second.
TEST(FilterPipeline, HypothesesMoveWithTheOdometryInBetween) {
  BeaconMclPipelineOptions options = BeaconMclDrive::options();
  options.filter.particles = 501;
  Rig run(options);
  run.feed(BeaconMclDrive::messages(20.0));
  for (const FilterStatus& status : run.out.statuses) {
    if (status.header.stamp < BeaconMclDrive::at(15.0)) continue;
    ASSERT_EQ(status.hypotheses.size(), 1u);
    const Pose2 truth = BeaconMclDrive::truth(status.header.stamp);
    EXPECT_LT(distance(to_pose2(status.hypotheses[0].pose.pose), truth), 0.3);
  }
}

// Where nobody looks, nothing is computed.
TYPED_TEST(FilterPipelineOf, NobodyAsksForHypotheses) {
  typename TypeParam::AnyOutputs out;
  auto sinks = sinks_into(&out);
  bool is_asked = false;
  sinks.wants_hypotheses = [&is_asked] { return is_asked; };
  typename TypeParam::Pipeline pipeline(TypeParam::Drive::options(), sinks);
  for (const auto& message : TypeParam::Drive::messages(0.0, 10.0)) handle(message, &pipeline);
  EXPECT_TRUE(out.statuses.back().hypotheses.empty());
  EXPECT_EQ(out.statuses.back().other_weight, 1.0);
  is_asked = true;
  for (const auto& message : TypeParam::Drive::messages(10.0, 12.0)) handle(message, &pipeline);
  EXPECT_EQ(out.statuses.back().hypotheses.size(), 1u);
}

// A range fits two places equally well that are equally far from its beacon.
TEST(FilterPipeline, TwoPlacesThatFitAreTwoHypotheses) {
  Rig run;
  run.feed(BeaconMclDrive::messages(0.0, 0.0));
  const Eigen::Vector2d beacon = BeaconMclDrive::beacons()[0].position.head<2>();
  const Pose2 there = BeaconMclDrive::truth(BeaconMclDrive::at(0.0));
  const Pose2 mirrored = {2.0 * beacon.x() - there.x, 2.0 * beacon.y() - there.y, 1.0};
  run.pipeline.handle(initial_pose(BeaconMclDrive::at(0.0), there));
  auto two_places = run.pipeline.checkpoint().value();
  BeaconMclParticles& particles = two_places.filter.particles;
  ASSERT_EQ(particles.size(), 400);
  for (Eigen::Index i = 0; i < 400; ++i) {
    const Pose2& pose = i < 244 ? there : mirrored;
    particles.x[i] = pose.x;
    particles.y[i] = pose.y;
    particles.heading[i] = pose.heading;
  }
  run.pipeline.resume(two_places);
  EXPECT_TRUE(run.out.statuses.empty() || run.out.statuses.back().hypotheses.size() < 2);
  nav_msgs::Odometry standing = BeaconMclDrive::odometry(BeaconMclDrive::at(0.0));
  for (int i = 1; i <= 10; ++i) {
    standing.header.stamp = BeaconMclDrive::at(0.1 * i);
    run.pipeline.handle(standing);
    BeaconRange range = BeaconMclDrive::range(BeaconMclDrive::at(0.0), 0);
    range.header.stamp = standing.header.stamp;
    run.pipeline.handle(range);
  }
  const FilterStatus& status = run.out.statuses.back();
  ASSERT_EQ(status.hypotheses.size(), 2u);
  // 244 of 400; ten ranges and their renewals draw with a standard deviation of 0.03 at most.
  EXPECT_NEAR(status.hypotheses[0].weight, 0.61, 0.12);
  EXPECT_NEAR(status.hypotheses[0].weight + status.hypotheses[1].weight, 1.0, 0.02);
  EXPECT_LT(distance(to_pose2(status.hypotheses[0].pose.pose), there), 0.5);
  EXPECT_LT(distance(to_pose2(status.hypotheses[1].pose.pose), mirrored), 0.5);
  EXPECT_TRUE(says(status.health_text, ". 2 places fit: "));
  const auto labels = markers_called(run.out.markers.back(), "hypothesis_weights");
  ASSERT_EQ(labels.size(), 2u);
  EXPECT_EQ(labels[0].text,
            std::to_string(std::lround(100.0 * status.hypotheses[0].weight)) + " %");
  EXPECT_EQ(markers_called(run.out.markers.back(), "hypotheses")[1].points.size(), 73u);
  EXPECT_EQ(value_of(run.out.diagnostics.back(), "places that fit").rfind("2 places fit: ", 0), 0u);

  // Told where it is, it knows one; the pictures of the others are taken away.
  run.pipeline.handle(initial_pose(BeaconMclDrive::at(1.0), there));
  for (int i = 11; i <= 20; ++i) {
    standing.header.stamp = BeaconMclDrive::at(0.1 * i);
    run.pipeline.handle(standing);
  }
  const auto gone =
      std::find_if(run.out.markers.begin(), run.out.markers.end(), [](const auto& array) {
        const auto ellipses = markers_called(array, "hypotheses");
        return ellipses.size() == 2 && ellipses[1].action == visualization_msgs::Marker::DELETE;
      });
  EXPECT_NE(gone, run.out.markers.end());
}

// ---- what comes in -----------------------------------------------------------------------------

TYPED_TEST(FilterPipelineOf, AnImuAndATypeThatAreOfNoUseAreCounted) {
  auto options = TypeParam::Drive::options();
  options.odometry_input.imu_heading = ImuUse::yaw_rate;
  TypeParam run(options);
  run.feed(TypeParam::Drive::messages(5.0));
  sensor_msgs::Imu imu;
  imu.header.frame_id = "nowhere";
  imu.header.stamp = TypeParam::Drive::at(5.0);
  run.pipeline.handle(imu);
  EXPECT_EQ(run.rejected("imu", RejectReason::unknown_frame), 1u);
  run.pipeline.note_unreadable("odom", "odometry comes as std_msgs/Int16");
  EXPECT_EQ(run.rejected("odom", RejectReason::unreadable), 1u);
  EXPECT_TRUE(run.has_said("odometry comes as std_msgs/Int16"));
  run.feed(TypeParam::Drive::messages(5.1, 8.0));
  EXPECT_LT(run.error(), kLost);
}

TEST(FilterPipeline, WithoutAMapARobotIsNotLookedForInIt) {
  FastSlamRig run;
  const std::string said = refusal([&] { run.pipeline.global_localization(); });
  EXPECT_EQ(
      said,
      "global_localization: there is no map yet to localize in; load one, or give initialpose");
  run.feed(FastSlamDrive::messages(20.0));
  EXPECT_LT(run.error(), kLost) << "and the drive goes on as if nothing had been asked";
}

// ---- parameters -------------------------------------------------------------------------------

TYPED_TEST(FilterPipelineOf, RefusedParametersChangeNothingAndSayWhy) {
  using Drive = typename TypeParam::Drive;
  TypeParam run;
  run.feed(Drive::messages(0.0, 5.0));
  // The second value is impossible: the first must not be taken either.
  EXPECT_THROW(run.pipeline.set_parameters(
                   {{"population/renewal", "compensation"}, {"population/threshold", "7"}}),
               Error);
  run.feed(Drive::messages(5.1, 6.0));
  EXPECT_TRUE(says(run.out.statuses.back().refused, "population/threshold"));
  EXPECT_FALSE(says(run.out.statuses.back().strategy, "compensation"));
  run.pipeline.set_parameters({{"population/renewal", "compensation"}});
  run.feed(Drive::messages(6.1, 7.0));
  EXPECT_EQ(run.out.statuses.back().refused, "");
  EXPECT_TRUE(says(run.out.statuses.back().strategy, "compensation"));
}

// Another count is drawn from the present population at the next update.
TYPED_TEST(FilterPipelineOf, AnotherParticleCountTakesEffectAtTheNextUpdate) {
  using Drive = typename TypeParam::Drive;
  TypeParam run;
  run.feed(Drive::messages(0.0, 10.0));
  const auto before = run.particles().size();
  run.pipeline.set_parameters({{"particles", std::to_string(2 * before)}});
  EXPECT_EQ(run.particles().size(), before);
  run.feed(Drive::messages(10.1, 11.0));
  EXPECT_EQ(run.particles().size(), 2 * before);
  EXPECT_LT(run.error(), kLost);
}

}  // namespace
}  // namespace pf_resampling
