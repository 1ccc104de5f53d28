// The pose that survives a restart: its file, the rule by which it is taken, and both pipelines.
#include "src/checkpoint/saved_pose.hpp"

#include <gtest/gtest.h>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "pf_resampling_core/test/temporary_directory.hpp"
#include "src/checkpoint/pose_keeper.hpp"
#include "test/beacon_mcl_rig.hpp"
#include "test/fastslam_rig.hpp"

namespace pf_resampling {
namespace {

constexpr std::int64_t kSecond = 1000000000;

SavedPose example() {
  SavedPose saved;
  saved.frame = "map";
  saved.map = "the map /home/me/my maps/50% of\nthe lab.map";
  saved.stamp = 1234 * kSecond + 5;
  saved.pose.mean = {1.0 / 3.0, -2.0e-7, 3.1};
  saved.pose.covariance << 0.04, 0.01, 0.002, 0.01, 0.09, -0.003, 0.002, -0.003, 0.0016;
  saved.odometry = {7.0, 8.0, -1.0};
  saved.stood_still = true;
  saved.lost = 0.01;
  return saved;
}

PoseAtStart start_of(const SavedPose& saved, double later, const Pose2& odometry) {
  PoseAtStart now;
  now.frame = saved.frame;
  now.map = saved.map;
  now.stamp = saved.stamp + static_cast<std::int64_t>(later * 1e9);
  now.odometry = odometry;
  now.oldest = 60.0;
  return now;
}

std::string reason(const SavedPose& saved, const PoseAtStart& now) {
  return reason_against(saved, now).value_or("");
}

TEST(SavedPose, ComesBackToTheBit) {
  const TemporaryDirectory directory;
  const SavedPose saved = example();
  write_saved_pose(directory.file("a.pose"), saved);
  const SavedPose read = read_saved_pose(directory.file("a.pose"));
  EXPECT_EQ(read.frame, saved.frame);
  EXPECT_EQ(read.map, saved.map);
  EXPECT_EQ(read.stamp, saved.stamp);
  EXPECT_EQ(read.pose.mean.x, saved.pose.mean.x);
  EXPECT_EQ(read.pose.mean.y, saved.pose.mean.y);
  EXPECT_EQ(read.pose.mean.heading, saved.pose.mean.heading);
  EXPECT_EQ(read.pose.covariance, saved.pose.covariance);
  EXPECT_EQ(read.odometry.x, saved.odometry.x);
  EXPECT_EQ(read.odometry.heading, saved.odometry.heading);
  EXPECT_TRUE(read.stood_still);
  EXPECT_EQ(read.lost, saved.lost);
}

TEST(SavedPose, WhatMakesNoSenseIsNotWritten) {
  const TemporaryDirectory directory;
  SavedPose pose = example();
  pose.pose.mean.y = std::nan("");
  EXPECT_THROW(write_saved_pose(directory.file("c"), pose), Error);
  for (double* const number : {&pose.pose.mean.y, &pose.odometry.x, &pose.pose.covariance(0, 0)}) {
    pose = example();
    *number = 1e19;
    EXPECT_THROW(write_saved_pose(directory.file("c"), pose), Error);
  }
  pose = example();
  pose.pose.covariance(1, 1) = -0.01;
  EXPECT_THROW(write_saved_pose(directory.file("c"), pose), Error);
  EXPECT_EQ(directory.listing(), "");
}

TEST(SavedPose, IsTakenWhenTheOdometryReadsTheSame) {
  const SavedPose saved = example();
  EXPECT_EQ(reason(saved, start_of(saved, 59.0, saved.odometry)), "");
  // 0.05 m ahead of a robot that the odometry has at -1 rad: 0.05 m ahead at 3.1 rad, too.
  const Pose2 ahead = compose(saved.odometry, {0.05, 0.0, 0.02});
  EXPECT_EQ(reason(saved, start_of(saved, 1.0, ahead)), "");
  const PoseEstimate there = pose_at_start(saved, ahead);
  EXPECT_NEAR(there.mean.x, saved.pose.mean.x + 0.05 * std::cos(3.1), 1e-12);
  EXPECT_NEAR(there.mean.y, saved.pose.mean.y + 0.05 * std::sin(3.1), 1e-12);
  EXPECT_NEAR(there.mean.heading, 3.12, 1e-12);
  EXPECT_EQ(there.covariance, saved.pose.covariance);
}

TEST(SavedPose, IsTakenAfterTheOdometryBeganAnewIfTheRobotStood) {
  SavedPose saved = example();
  EXPECT_EQ(reason(saved, start_of(saved, 1.0, {0.02, 0.0, 0.01})), "");
  EXPECT_EQ(pose_at_start(saved, {0.02, 0.0, 0.01}).mean.x, saved.pose.mean.x);
  saved.stood_still = false;
  EXPECT_EQ(reason(saved, start_of(saved, 1.0, {})),
            "the odometry read (7.000, 8.000) m, -1.000 rad when it was saved and reads (0.000, "
            "0.000) m, 0.000 rad now: it was reset, and the robot was driving");
}

TEST(SavedPose, IsRefusedWithTheReason) {
  SavedPose saved = example();
  EXPECT_EQ(reason(saved, start_of(saved, 1.0, {7.2, 8.0, -1.0})),
            "the odometry read (7.000, 8.000) m, -1.000 rad when it was saved and reads (7.200, "
            "8.000) m, -1.000 rad now: the robot was moved meanwhile");
  EXPECT_NE(reason(saved, start_of(saved, 1.0, {7.0, 8.0, -0.8})), "");
  EXPECT_EQ(reason(saved, start_of(saved, 61.0, saved.odometry)),
            "it is 61.000 s old, more than pose/oldest, which is 60.000 s");
  EXPECT_EQ(reason(saved, start_of(saved, -2.0, saved.odometry)),
            "it is from 2.000 s after the first odometry: the clock was set back, or a bag is "
            "played again");
  PoseAtStart now = start_of(saved, 1.0, saved.odometry);
  now.frame = "hall";
  EXPECT_EQ(reason(saved, now), "it is in the frame \"map\", and frames/map is hall");
  now = start_of(saved, 1.0, saved.odometry);
  now.map = "the map /b";
  EXPECT_TRUE(says(reason(saved, now), ", and this is \"the map /b\""));
  now.map.clear();
  EXPECT_TRUE(says(reason(saved, now), "no map is loaded now"));
  saved.lost = 0.6;
  EXPECT_EQ(reason(saved, start_of(saved, 1.0, saved.odometry)),
            "the filter did not know where it was when it was saved (lost: 0.600)");
}

// ---- the pipelines ------------------------------------------------------------------------------

// Saves after 40 s of a drive, and starts another filter as the same node would be.
struct BeaconRestart {
  using AnyRig = Rig;
  explicit BeaconRestart(double until = 40.0) {
    first.feed(BeaconMclDrive::messages(until));
    options = BeaconMclDrive::options();
    options.beacons = BeaconMclDrive::beacons();
    saved = first.pipeline.pose_to_save();
  }
  // Would put the robot somewhere else.
  void start_elsewhere() {
    options.filter.initialization.method = Initialization::gaussian;
    options.filter.initialization.x = -8.0;
  }
  Rig first;
  BeaconMclPipelineOptions options;
  std::optional<SavedPose> saved;
};

struct FastSlamRestart {
  using AnyRig = FastSlamRig;
  explicit FastSlamRestart(double until = 40.0) {
    first.feed(FastSlamDrive::messages(until));
    before_map = first.pipeline.pose_to_save();
    first.pipeline.save_map(directory.file("lab.map"));
    options = FastSlamDrive::options();
    options.map_file = directory.file("lab.map");
    options.filter.map.frozen = true;
    saved = first.pipeline.pose_to_save();
  }
  void start_elsewhere() { options.starts_anywhere = true; }
  TemporaryDirectory directory;
  FastSlamRig first;
  FastSlamPipelineOptions options;
  std::optional<SavedPose> before_map, saved;
};

template <typename Restart>
class SavedPoseOf : public testing::Test {
 protected:
  using AnyRig = typename Restart::AnyRig;
  using Drive = typename AnyRig::Drive;

  // What the odometry reads `seconds` after the start of the drive, at another time.
  static nav_msgs::Odometry reading(double seconds, double time) {
    nav_msgs::Odometry odometry = Drive::odometry(Drive::at(seconds));
    odometry.header.stamp = Drive::at(time);
    return odometry;
  }
  Restart restart;
  // Of the mean of 60 particles or more of a filter that knows where it is.
  static constexpr double kNear = 0.2;  // m
};
using Restarts = testing::Types<BeaconRestart, FastSlamRestart>;
TYPED_TEST_SUITE(SavedPoseOf, Restarts);

// Before it has seen anything; over all other ways to start.
TYPED_TEST(SavedPoseOf, PutsTheRobotThereAtTheFirstOdometry) {
  using Of = typename TestFixture::Drive;
  ASSERT_TRUE(this->restart.saved);
  EXPECT_FALSE(this->restart.saved->stood_still);
  this->restart.start_elsewhere();
  typename TestFixture::AnyRig run(this->restart.options);
  run.pipeline.offer_pose(*this->restart.saved, "a.pose");
  run.pipeline.handle(this->reading(40.0, 50.0));
  ASSERT_EQ(run.out.poses.size(), 1u);
  EXPECT_LT(distance(run.pose(), Of::truth(Of::at(40.0))), this->kNear);
  EXPECT_TRUE(run.has_said("pose of a.pose taken, 10.000 s old: the robot is put at ("));
  EXPECT_EQ(run.pipeline.offer(), "the saved pose was taken");
  // And with its uncertainty: 60 particles or more give a variance to a factor of 2.
  const Eigen::Matrix3d is = run.pipeline.estimate()->covariance;
  EXPECT_LT(is(0, 0), 2.5 * this->restart.saved->pose.covariance(0, 0) + 1e-3);
  EXPECT_GT(is(0, 0), this->restart.saved->pose.covariance(0, 0) / 2.5 - 1e-3);
  EXPECT_LT(run.pipeline.lost_probability(), kLikelyLost);
}

TYPED_TEST(SavedPoseOf, IsRefusedWhenOldOrTheOdometerHasGoneOn) {
  this->restart.start_elsewhere();
  this->restart.options.saved_pose.oldest = 5.0;
  typename TestFixture::AnyRig old(this->restart.options);
  old.pipeline.offer_pose(*this->restart.saved, "a.pose");
  old.pipeline.handle(this->reading(40.0, 50.0));
  EXPECT_TRUE(old.has_said("the pose of a.pose is not taken: it is 10.000 s old"));
  this->restart.options.saved_pose.oldest = 3600.0;
  typename TestFixture::AnyRig moved(this->restart.options);
  moved.pipeline.offer_pose(*this->restart.saved, "a.pose");
  moved.pipeline.handle(this->reading(40.3, 50.0));
  EXPECT_TRUE(moved.has_said("the robot was moved meanwhile"));
  EXPECT_EQ(moved.pipeline.offer().rfind("the saved pose was not taken: the odometry read", 0), 0u);
  for (const auto* run : {&old, &moved}) {
    EXPECT_FALSE(run->has_said("the robot is put at"));
    const auto estimate = run->pipeline.estimate();
    EXPECT_TRUE(!estimate || distance(estimate->mean, this->restart.saved->pose.mean) > 1.0 ||
                estimate->covariance(0, 0) > 1.0);
  }
}

TYPED_TEST(SavedPoseOf, AnInitialPoseAndACheckpointAreStronger) {
  typename TestFixture::AnyRig told(this->restart.options);
  told.pipeline.offer_pose(*this->restart.saved, "a.pose");
  told.pipeline.handle(initial_pose(TestFixture::Drive::at(50.0), {3.0, 1.0, 0.5}));
  told.pipeline.handle(this->reading(40.0, 50.0));
  EXPECT_LT(distance(told.pose(), {3.0, 1.0, 0.5}), this->kNear);
  EXPECT_FALSE(told.has_said("pose of a.pose taken"));

  typename TestFixture::AnyRig later(this->restart.options);
  later.pipeline.offer_pose(*this->restart.saved, "a.pose");
  later.pipeline.handle(this->reading(40.0, 50.0));
  later.pipeline.handle(initial_pose(TestFixture::Drive::at(50.0), {3.0, 1.0, 0.5}));
  later.pipeline.handle(this->reading(40.0, 50.1));
  EXPECT_LT(distance(later.pose(), {3.0, 1.0, 0.5}), this->kNear);

  typename TestFixture::AnyRig resumed(this->restart.options);
  SavedPose elsewhere = *this->restart.saved;
  elsewhere.pose.mean.x += 5.0;
  resumed.pipeline.offer_pose(elsewhere, "a.pose");
  resumed.pipeline.resume(*this->restart.first.pipeline.checkpoint());
  resumed.pipeline.handle(this->reading(40.0, 41.0));
  EXPECT_LT(distance(resumed.pose(), this->restart.saved->pose.mean), this->kNear);
  EXPECT_EQ(resumed.pipeline.offer(), "the saved pose was not taken: a checkpoint says more");
}

TYPED_TEST(SavedPoseOf, ARobotThatStandsSaysSo) {
  auto& first = this->restart.first.pipeline;
  for (int i = 1; i <= 8; ++i) first.handle(this->reading(40.0, 40.0 + 0.1 * i));
  EXPECT_FALSE(first.pose_to_save()->stood_still);
  for (int i = 9; i <= 12; ++i) first.handle(this->reading(40.0, 40.0 + 0.1 * i));
  ASSERT_TRUE(first.pose_to_save()->stood_still);
  typename TestFixture::AnyRig run(this->restart.options);
  run.pipeline.offer_pose(*first.pose_to_save(), "a.pose");
  nav_msgs::Odometry zero = this->reading(0.0, 50.0);
  zero.pose.pose = to_pose_message({});
  run.pipeline.handle(zero);
  EXPECT_TRUE(run.has_said("pose of a.pose taken"));
}

TYPED_TEST(SavedPoseOf, ThereIsNoneBeforeTheFilterRuns) {
  typename TestFixture::AnyRig run(this->restart.options);
  EXPECT_FALSE(run.pipeline.pose_to_save());
  EXPECT_EQ(run.pipeline.offer(), "no pose was saved");
}

// The beacons may come after the odometry: what that read first counts.
TEST(SavedPoseOfBeacons, WaitsForTheBeacons) {
  BeaconRestart restart;
  Rig run;
  run.pipeline.offer_pose(*restart.saved, "a.pose");
  for (int i = 0; i <= 20; ++i) {
    run.pipeline.handle(BeaconMclDrive::odometry(BeaconMclDrive::at(40.0 + 0.1 * i)));
  }
  EXPECT_TRUE(run.out.poses.empty());
  run.pipeline.handle(BeaconMclDrive::beacon_array());
  run.pipeline.handle(BeaconMclDrive::odometry(BeaconMclDrive::at(42.1)));
  ASSERT_EQ(run.out.poses.size(), 1u);
  EXPECT_LT(run.error(), 0.3);
}

TEST(SavedPoseOfBeacons, AmongOtherBeaconsItIsRefused) {
  BeaconRestart restart;
  restart.options.beacons[2].position.y() += 0.5;
  Rig run(restart.options);
  run.pipeline.offer_pose(*restart.saved, "a.pose");
  nav_msgs::Odometry odometry = BeaconMclDrive::odometry(BeaconMclDrive::at(40.0));
  run.pipeline.handle(odometry);
  EXPECT_TRUE(run.has_said("it was saved in \"the beacons 10, 11, 12, 13 ("));
}

// A map that is in no file begins where the robot is switched on: no other run knows it.
TEST(SavedPoseOfAMap, ThereIsOneOnlyForAMapThatIsInAFile) {
  FastSlamRestart restart;
  EXPECT_FALSE(restart.before_map);
  ASSERT_TRUE(restart.saved);
  restart.options.map_file.clear();
  FastSlamRig run(restart.options);
  run.pipeline.offer_pose(*restart.saved, "a.pose");
  run.pipeline.handle(FastSlamDrive::odometry(FastSlamDrive::at(40.0)));
  EXPECT_TRUE(run.has_said("but no map is loaded now"));
}

// A file may say what the filter does not take: a covariance with a negative eigenvalue.
TEST(SavedPoseOfAMap, OneThatTheFilterRefusesIsNotTaken) {
  FastSlamRestart restart;
  FastSlamRig run(restart.options);
  SavedPose impossible = *restart.saved;
  impossible.pose.covariance.setIdentity();
  impossible.pose.covariance(0, 1) = impossible.pose.covariance(1, 0) = 2.0;
  run.pipeline.offer_pose(impossible, "a.pose");
  run.pipeline.handle(FastSlamDrive::odometry(FastSlamDrive::at(40.0)));
  EXPECT_TRUE(run.has_said("the pose of a.pose is not taken: poses to set: the covariance"));
  EXPECT_EQ(run.pipeline.rejects().total(), 0u);
  EXPECT_FALSE(run.has_said("the robot is put at"));
}

// ---- the keeper ---------------------------------------------------------------------------------

struct Kept {
  explicit Kept(const SavedPoseOptions& options, const std::string& default_file = "")
      : keeper(
            options,
            [default_file]() -> std::string {
              if (default_file.empty()) throw Error("the folder cannot be made");
              return default_file;
            },
            [this](LogLevel, const std::string& text) { log.push_back(text); }) {}
  diagnostic_msgs::DiagnosticArray report() {
    diagnostic_msgs::DiagnosticArray array;
    keeper.report("saved pose", "as said", &array);
    return array;
  }
  std::vector<std::string> log;
  PoseKeeper keeper;
};

TEST(PoseKeeper, IsOffByDefault) {
  Kept kept{SavedPoseOptions()};
  EXPECT_FALSE(kept.keeper.is_used());
  EXPECT_FALSE(kept.keeper.read());
  EXPECT_TRUE(kept.report().status.empty());
  EXPECT_TRUE(kept.log.empty());
}

TEST(PoseKeeper, WritesWhenDueAndAtTheEndAndReads) {
  const TemporaryDirectory directory;
  SavedPoseOptions options;
  options.save_every = 0.05;
  BeaconRestart restart;
  {
    Kept kept(options, directory.file("robot.pose"));
    EXPECT_FALSE(kept.keeper.read());
    kept.keeper.write_when_due(&restart.first.pipeline);
    EXPECT_EQ(directory.listing(), "");
    ros::WallDuration(0.06).sleep();
    kept.keeper.write_when_due(&restart.first.pipeline);
    while (value_of(kept.report(), "written") != "1") ros::WallDuration(0.005).sleep();
    EXPECT_EQ(read_saved_pose(directory.file("robot.pose")).stamp, restart.saved->stamp);
    restart.first.feed(BeaconMclDrive::messages(40.0, 41.0));
    kept.keeper.write_now(&restart.first.pipeline);
    EXPECT_EQ(kept.report().status.at(0).message, "fine");
    EXPECT_EQ(value_of(kept.report(), "started"), "as said");
  }
  Kept next(options, directory.file("robot.pose"));
  const auto read = next.keeper.read();
  ASSERT_TRUE(read);
  EXPECT_EQ(read->stamp, restart.saved->stamp + kSecond);
}

TEST(PoseKeeper, TellsOfWhatCannotBeReadOrWritten) {
  const TemporaryDirectory directory;
  SavedPoseOptions options;
  options.save_every = 1.0;
  const std::string file = directory.write("a", "notes of mine\n");
  Kept damaged(options, file);
  EXPECT_FALSE(damaged.keeper.read());
  ASSERT_EQ(damaged.log.size(), 1u);
  EXPECT_EQ(damaged.log[0].rfind("the saved pose is not used: pose file " + file, 0), 0u);
  EXPECT_EQ(damaged.report().status.at(0).level, diagnostic_msgs::DiagnosticStatus::WARN);
  Kept homeless(options);
  EXPECT_EQ(homeless.log,
            std::vector<std::string>{"the pose is not saved: the folder cannot be made"});
  EXPECT_FALSE(homeless.keeper.read());
  EXPECT_EQ(homeless.report().status.at(0).message, homeless.log[0]);
}

}  // namespace
}  // namespace pf_resampling
