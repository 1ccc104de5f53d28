#include "fastslam_node/fastslam_pipeline.hpp"

#include <gtest/gtest.h>

#include "test/fastslam_rig.hpp"

namespace pf_resampling {
namespace {

using Drive = FastSlamDrive;

// ---- time -------------------------------------------------------------------------------------

// A clock that is set while the robot drives: no reason to forget the map.
TEST(FastSlamPipeline, AClockThatIsSetBackIsNoNewStart) {
  FastSlamRig run;
  run.feed(Drive::messages(45.0));
  const ros::Duration back(20.0);
  for (double time = 45.1; time < 55.0; time += 0.1) {
    nav_msgs::Odometry odometry = Drive::odometry(Drive::at(time));
    odometry.header.stamp -= back;
    run.pipeline.handle(odometry);
    LandmarkObservationArray scan = Drive::scan(Drive::at(time));
    scan.header.stamp -= back;
    run.pipeline.handle(scan);
  }
  EXPECT_FALSE(run.has_said("the filter is reset"));
  EXPECT_LT(distance(run.pose(), Drive::truth(run.out.poses.back().header.stamp + back)), kLost);
  run.pipeline.publish_results();
  EXPECT_EQ(run.out.maps.back().landmarks.size(), 12u);
  EXPECT_LT(run.map_error(), kLost);
}

TEST(FastSlamPipeline, NothingOfAnOldScanIsShown) {
  FastSlamRig run;
  run.feed(Drive::messages(10.0));
  for (int i = 101; i <= 400; ++i) run.pipeline.handle(Drive::odometry(Drive::at(0.1 * i)));
  for (const auto& name : {"seen_again", "seen_first", "not_believed"}) {
    const auto lines = markers_called(run.out.markers.back(), name);
    ASSERT_EQ(lines.size(), 1u);
    EXPECT_EQ(lines[0].action, visualization_msgs::Marker::DELETE) << name;
  }
}

TEST(FastSlamPipeline, AGapOfTheOdometryIsTakenAsMotion) {
  FastSlamRig run;
  run.feed(Drive::messages(0.0, 20.0));
  // 8 s of silence: as long as it takes to drive a fifth of the circle.
  run.feed(Drive::messages(28.0, 40.0));
  EXPECT_EQ(run.rejected("odom", RejectReason::time_gap), 4u);
  EXPECT_TRUE(run.has_said("no odometry for"));
  EXPECT_LT(run.error(), kLost);
  EXPECT_LT(run.map_error(), kLost);
}

TEST(FastSlamPipeline, AJumpOfTheOdometryIsNoMotion) {
  FastSlamRig run;
  run.feed(Drive::messages(0.0, 20.0));
  // From here on odometry says something else: it was restarted elsewhere.
  run.feed(changed<nav_msgs::Odometry>(Drive::messages(20.1, 40.0), [](auto* odometry) {
    geometry_msgs::Pose& pose = odometry->pose.pose;
    pose = to_pose_message(compose({50.0, -20.0, 2.0}, to_pose2(pose)));
  }));
  EXPECT_EQ(run.rejected("odom", RejectReason::pose_jump), 4u);
  EXPECT_EQ(value_of(run.out.diagnostics.back(), "jumps of the pose"), "1");
  EXPECT_LT(run.error(), kLost);
  EXPECT_LT(run.map_error(), kLost);
}

// ---- the pose ---------------------------------------------------------------------------------

TEST(FastSlamPipeline, ThePoseIsTheFiltersMovedByOdometry) {
  FastSlamPipelineOptions options = Drive::options();
  options.filter.odometry_errors.estimate = false;  // else it is moved by what odometry should say
  FastSlamRig run(options);
  for (const FastSlamMessage& message : Drive::messages(10.0)) {
    handle(message, &run.pipeline);
    if (!std::holds_alternative<nav_msgs::Odometry::ConstPtr>(message)) continue;
    const ros::Time stamp = run.out.poses.back().header.stamp;
    // The filter stands at its last scan; from there odometry, which is exact, leads here.
    const ros::Time used = run.out.updates.empty() ? Drive::at(0.0) : run.out.updates.back();
    const Pose2 expected = compose(run.pipeline.filter().estimate().mean,
                                   relative(Drive::truth(used), Drive::truth(stamp)));
    const Pose2 pose = run.pose();
    EXPECT_NEAR(pose.x, expected.x, 1e-6);
    EXPECT_NEAR(pose.y, expected.y, 1e-6);
    EXPECT_NEAR(wrap_angle(pose.heading - expected.heading), 0.0, 1e-6);
  }
  EXPECT_EQ(run.out.poses.size(), 101u);
}

// ---- the end ----------------------------------------------------------------------------------

// The last map is smoothed, and the filter does not notice.
TEST(FastSlamPipeline, ResultsAreSmoothedOnACopy) {
  auto options = options_of_redraw<Drive>();
  FastSlamRig run(options), other(options);
  for (FastSlamRig* rig : {&run, &other}) rig->feed(Drive::messages(20.0));
  const FastSlamParticles particles = run.particles();
  run.pipeline.publish_results();
  EXPECT_TRUE(same_particles(run.particles(), particles));
  FastSlam smoothed = run.pipeline.filter();
  ASSERT_TRUE(smoothed.smooth());
  const std::vector<LandmarkEstimate> map = smoothed.map();
  ASSERT_EQ(run.out.maps.back().landmarks.size(), map.size());
  for (std::size_t l = 0; l < map.size(); ++l) {
    EXPECT_EQ(run.out.maps.back().landmarks[l].position.x, map[l].mean.x());
  }
  for (FastSlamRig* rig : {&run, &other}) rig->feed(Drive::messages(20.1, 40.0));
  EXPECT_TRUE(same_particles(run.particles(), other.particles()));
}

// What takes the results may fail, as on a full disk: the filter is still the one that ran.
TEST(FastSlamPipeline, ResultsThatCannotBeGivenOutLeaveTheFilterAsItIs) {
  auto options = options_of_redraw<Drive>();
  FastSlamOutputs out;
  bool is_full = false;
  FastSlamSinks sinks = sinks_into(&out);
  sinks.landmark_map = [&](const LandmarkMap&) {
    if (is_full) throw Error("the disk is full");
  };
  FastSlamPipeline pipeline(options, sinks);
  for (const auto& message : Drive::messages(20.0)) handle(message, &pipeline);
  const FastSlamParticles particles = pipeline.filter().particles();
  is_full = true;
  EXPECT_THROW(pipeline.publish_results(), Error);
  EXPECT_TRUE(same_particles(pipeline.filter().particles(), particles));
}

// ---- starting elsewhere -----------------------------------------------------------------------

TEST(FastSlamPipeline, AnInitialPosePutsTheRobotThereAndKeepsTheMap) {
  FastSlamRig run;
  run.feed(Drive::messages(40.0));
  run.pipeline.handle(initial_pose(Drive::at(40.0), {1.0, 2.0, 0.5}, 0.01));
  ASSERT_TRUE(run.pipeline.estimate().has_value());
  // The mean of 60 particles of sigma 0.1 is off by 0.013; six times that.
  EXPECT_NEAR(run.pipeline.estimate()->mean.x, 1.0, 0.08);
  EXPECT_NEAR(run.pipeline.estimate()->mean.y, 2.0, 0.08);
  EXPECT_NEAR(run.pipeline.estimate()->mean.heading, 0.5, 0.08);
  run.pipeline.publish_results();
  EXPECT_EQ(run.out.maps.back().landmarks.size(), 12u);
  EXPECT_LT(run.map_error(), kLost);

  // Put back where it is, it goes on in its map.
  run.pipeline.handle(initial_pose(Drive::at(40.0), Drive::truth(Drive::at(40.0)), 0.0025));
  run.feed(Drive::messages(40.1, 60.0));
  EXPECT_LT(run.error(), kLost);
  EXPECT_LT(run.map_error(), kLost);
  EXPECT_EQ(run.out.maps.back().landmarks.size(), 12u);
}

// ---- carried away -----------------------------------------------------------------------------

// The robot is carried 12 s ahead on its circle, which odometry does not notice.
void kidnap(FastSlamRig* run, double from, double until) {
  const ros::Duration ahead(12.0);
  for (double time = from; time < until; time += 0.2) {
    const ros::Time stamp = Drive::at(time);
    run->pipeline.handle(Drive::odometry(stamp));
    LandmarkObservationArray scan = Drive::scan(stamp + ahead);
    scan.header.stamp = stamp;
    run->pipeline.handle(scan);
  }
}

// Wheels that count 4 % too much.
TEST(FastSlamPipeline, ErrorsOfTheOdometryAreToldWithTheirSigma) {
  FastSlamRig run;
  for (double time = 0.0; time < 60.0; time += 0.2) {
    nav_msgs::Odometry odometry = Drive::odometry(Drive::at(time));
    lengthen(&odometry);
    run.pipeline.handle(odometry);
    run.pipeline.handle(Drive::scan(Drive::at(time)));
  }
  const FilterStatus& status = run.out.statuses.back();
  ASSERT_EQ(status.systematic_errors.size(), 2u);
  const SystematicError& distances = status.systematic_errors[0];
  const SystematicError& turns = status.systematic_errors[1];
  EXPECT_EQ(distances.name, "distance_scale");
  EXPECT_NEAR(distances.value, 1.04, 3.0 * distances.sigma);
  EXPECT_LT(distances.sigma, 0.02);
  EXPECT_EQ(turns.name, "turn_scale");
  EXPECT_NEAR(turns.value, 1.0, 3.0 * turns.sigma);
  EXPECT_LT(turns.sigma, 0.1);
  EXPECT_NEAR(status.yaw_rate_bias, 0.0, 3.0 * status.yaw_rate_bias_sigma);
  EXPECT_GT(status.yaw_rate_bias_sigma, 0.0);
}

TEST(FastSlamPipeline, ARobotThatIsCarriedAwayIsFoundByTheLandmarksItSees) {
  FastSlamRig run;
  run.feed(Drive::messages(45.0));
  kidnap(&run, 45.2, 50.0);
  EXPECT_LT(
      distance(run.pose(), Drive::truth(run.out.poses.back().header.stamp + ros::Duration(12.0))),
      kLost);
  EXPECT_TRUE(run.has_said("lost: the latest landmarks fit the map"));
  EXPECT_EQ(run.out.statuses.back().injected, 60u);
  run.pipeline.publish_results();
  EXPECT_EQ(run.out.maps.back().landmarks.size(), 12u);
  EXPECT_LT(run.map_error(), kLost);
}

// While landmarks in view hold the belief, wheels that slip by 0.4 m/s move it nowhere; nor does an
// id that is seen where another landmark is, 18 m away.
TEST(FastSlamPipeline, WheelsThatSlipInAKnownMapAreFound) {
  FastSlamRig run;
  run.feed(Drive::messages(45.0));
  run.pipeline.set_parameters({{"map/frozen", "true"}});
  run.feed(Drive::messages(45.1, 60.0));
  EXPECT_TRUE(run.out.statuses.back().findings.empty());
  const ros::Duration back(20.0);  // a clock that is set
  double ahead = 0.0;
  for (double time = 60.1; time < 70.0; time += 0.1) {
    if (time > 65.0 && time < 68.0) ahead += 0.04;
    nav_msgs::Odometry odometry = Drive::odometry(Drive::at(time));
    odometry.pose.pose.position.x += ahead;
    odometry.header.stamp -= back;
    run.pipeline.handle(odometry);
    LandmarkObservationArray scan = Drive::scan(Drive::at(time));
    scan.header.stamp -= back;
    for (LandmarkObservation& seen : scan.observations) seen.id = seen.id == 8 ? 2 : seen.id;
    run.pipeline.handle(scan);
  }
  const std::vector<FindingStatus>& findings = run.out.statuses.back().findings;
  ASSERT_EQ(findings.size(), 2u);
  EXPECT_EQ(findings[0].id, 2);
  const FindingStatus& slip = findings[1];
  EXPECT_EQ(slip.kind, "wheels_slipped");
  EXPECT_GT(slip.end.toSec(), Drive::at(45.0).toSec());
  EXPECT_LT(slip.begin.toSec(), Drive::at(48.0).toSec());
  EXPECT_NEAR(slip.size, 1.2, 0.3);
}

TEST(FastSlamPipeline, ScansThatAreWrongAllOverCarryNobodyAway) {
  FastSlamRig run;
  run.feed(Drive::messages(45.0));
  for (double time = 45.0; time < 60.0; time += 1.0) {
    LandmarkObservationArray turned = Drive::scan(Drive::at(time + 0.01));
    for (LandmarkObservation& seen : turned.observations) seen.bearing += 1.0;
    run.pipeline.handle(turned);
    run.feed(Drive::messages(time + 0.1, time + 0.9));
  }
  EXPECT_EQ(run.out.statuses.back().injected, 0u);
  EXPECT_LT(run.error(), kLost);
}

TEST(FastSlamPipeline, RecoveryCanBeSwitchedWhileItRuns) {
  const ros::Duration ahead(12.0);
  FastSlamRig run;
  run.feed(Drive::messages(45.0));
  run.pipeline.set_parameters({{"recovery/enabled", "false"}});
  kidnap(&run, 45.2, 50.0);
  EXPECT_GT(distance(run.pose(), Drive::truth(run.out.poses.back().header.stamp + ahead)), 2.0);
  EXPECT_GT(run.out.statuses.back().lost, kLikelyLost);
  run.pipeline.set_parameters({{"recovery/enabled", "true"}});
  kidnap(&run, 50.0, 52.0);
  EXPECT_LT(distance(run.pose(), Drive::truth(run.out.poses.back().header.stamp + ahead)), kLost);
}

TEST(FastSlamPipeline, GlobalLocalizationLooksForTheRobotInTheWholeMap) {
  FastSlamRig run;
  EXPECT_THROW(run.pipeline.global_localization(), Error);
  run.feed(Drive::messages(45.0));
  run.pipeline.global_localization();
  EXPECT_TRUE(run.has_said("global localization in the whole map"));
  // Over 20 m of map: nobody knows where it is.
  const Eigen::Matrix3d spread = run.pipeline.estimate()->covariance;
  EXPECT_GT(spread(0, 0) + spread(1, 1), 4.0);
  run.feed(Drive::messages(45.1, 60.0));
  EXPECT_LT(run.error(), kLost);
  run.pipeline.publish_results();
  EXPECT_EQ(run.out.maps.back().landmarks.size(), 12u);
}

TEST(FastSlamPipeline, AMapTooLargeToBeRedrawnIsSaid) {
  FastSlamPipelineOptions options;
  options.filter.strategy.redraw.max_landmarks = 3;
  FastSlamRig run(options);
  run.feed(Drive::messages(20.0));
  EXPECT_EQ(run.out.diagnostics.back().status[0].message,
            "no redraw: the map has more than 3 landmarks (population/redraw/max_landmarks); only "
            "resampling continues");
}

// The map is 20 m wide at most; a deviation of 5 m in x and y is a third of that.
TEST(FastSlamPipeline, ABeliefAsWideAsTheMapIsNone) {
  FastSlamRig run;
  run.feed(Drive::messages(40.0));
  run.pipeline.handle(Drive::odometry(Drive::at(40.1)));  // the last scan is used
  EXPECT_LT(run.pipeline.lost_probability(), 0.01);
  run.pipeline.handle(initial_pose(Drive::at(40.1), Drive::truth(Drive::at(40.1)), 25.0));
  EXPECT_GT(run.pipeline.lost_probability(), 0.9);
  for (int i = 402; i <= 420; ++i) run.pipeline.handle(Drive::odometry(Drive::at(0.1 * i)));
  EXPECT_EQ(run.out.diagnostics.back().status[0].message,
            "the position is uncertain by a large part of the scene");
}

// Put down within metres, it makes its map from there: particles disagree by metres about where the
// map lies, and by centimetres about where the robot is in it.
TEST(FastSlamPipeline, ARobotThatKnowsItsPlaceInItsMapIsNotLost) {
  FastSlamRig run;
  run.pipeline.handle(Drive::odometry(Drive::at(0.0)));
  geometry_msgs::PoseWithCovarianceStamped start = initial_pose(Drive::at(0.0), {}, 9.0);
  start.pose.covariance[35] = 1e-6;
  run.pipeline.handle(start);
  EXPECT_GT(run.pipeline.lost_probability(), 0.5);
  run.feed(Drive::messages(0.1, 30.0));
  const Eigen::Matrix3d spread = run.pipeline.estimate()->covariance;
  EXPECT_GT(spread(0, 0) + spread(1, 1), 1.0);
  EXPECT_LT(run.pipeline.lost_probability(), 0.1);
  EXPECT_NE(run.pipeline.health().health, Health::converging);
}

TEST(FastSlamPipeline, ARobotThatHasJustBegunIsNotLost) {
  FastSlamRig run;
  for (int i = 0; i <= 30; ++i) {
    run.pipeline.handle(Drive::odometry(Drive::at(0.1 * i)));
    ASSERT_LT(run.pipeline.lost_probability(), 0.5) << i;  // from there on it warns
  }
}

TEST(FastSlamPipeline, AnInitialPoseCanComeBeforeAllOdometry) {
  const Pose2 start{4.0, -3.0, 1.0};
  FastSlamRig run;
  run.pipeline.handle(initial_pose(Drive::at(0.0), start, 0.0));
  run.feed(Drive::messages(10.0));
  const Pose2 truth = compose(start, Drive::truth(Drive::at(10.0)));
  EXPECT_LT(distance(run.pose(), truth), kLost);
}

TEST(FastSlamPipeline, ResetStartsAnew) {
  FastSlamRig run;
  const auto drive = Drive::messages(20.0);
  FastSlamRig fresh;
  fresh.feed(drive);
  run.feed(drive);
  run.pipeline.reset();
  EXPECT_FALSE(run.pipeline.estimate().has_value());
  EXPECT_EQ(run.pipeline.filter().status().landmarks, 0);
  EXPECT_EQ(run.pipeline.filter().status().updates, 0);
  const std::size_t poses = run.out.poses.size();
  run.feed(drive);
  ASSERT_EQ(run.out.poses.size(), 2 * poses);
  // As after construction, to the bit.
  run.out.poses.erase(run.out.poses.begin(), run.out.poses.begin() + static_cast<long>(poses));
  EXPECT_TRUE(same_bytes(run.out.poses, fresh.out.poses));
}

// ---- maps -------------------------------------------------------------------------------------

TEST(FastSlamPipeline, ByDefaultASavedMapHoldsAllParticles) {
  // Else going on from it is not what it would have been.
  const FastSlamPipelineOptions options;
  EXPECT_GE(options.map_file_particles, options.filter.particles);
}

}  // namespace
}  // namespace pf_resampling
