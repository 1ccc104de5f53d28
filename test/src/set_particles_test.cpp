// Particles from outside, for both pipelines.
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "test/beacon_mcl_rig.hpp"
#include "test/fastslam_rig.hpp"

namespace pf_resampling {
namespace {

// On a line through `center`, 0.1 m apart, the middle one there.
geometry_msgs::PoseArray poses_about(const Pose2& center, int count) {
  geometry_msgs::PoseArray array;
  array.header.frame_id = "map";
  for (int i = 0; i < count; ++i) {
    const double aside = 0.1 * (i - (count - 1) / 2);
    array.poses.push_back(to_pose_message(compose(center, {0.0, aside, 0.0})));
  }
  return array;
}

// All of the drives after `from`, s, until `until`.
void go_on(Rig* run, double from, double until) {
  run->feed(BeaconMclDrive::messages(from, until));
}
void go_on(FastSlamRig* run, double from, double until) {
  run->feed(FastSlamDrive::messages(from + 0.1, until));
}

// Both alike: what was given is the belief at once, at its stamp, moved on by the odometry since;
// the robot, told a place that is wrong, comes back from there.
template <typename AnyRig>
void expect_taken(AnyRig* run, const Pose2& truth, ros::Time stamp, int particles) {
  geometry_msgs::PoseArray array = poses_about(compose(truth, {0.3, 0.2, 0.1}), 21);
  array.header.stamp = stamp;
  EXPECT_EQ(run->pipeline.set_particles(array, {}), "21 particles set");
  ASSERT_TRUE(run->pipeline.estimate());
  const Pose2 believed = run->pipeline.estimate()->mean;
  // But for the delay of the odometry that FastSLAM has learnt.
  EXPECT_NEAR(relative(truth, believed).x, 0.3, 0.02);
  EXPECT_NEAR(relative(truth, believed).y, 0.2, 0.02);
  EXPECT_NEAR(wrap_angle(believed.heading - truth.heading), 0.1, 0.01);
  go_on(run, 12.0, 13.0);
  EXPECT_EQ(static_cast<int>(run->out.statuses.back().particles), particles);
  go_on(run, 13.0, 30.0);
  EXPECT_LT(run->error(), 0.3);
  EXPECT_TRUE(all_finite(run->out));
}

TEST(SetParticles, BeaconMclGoesOnFromThem) {
  Rig run;
  run.feed(BeaconMclDrive::messages(0.0, 12.0));
  const ros::Time now(BeaconMclDrive::kStart + 12.0);
  expect_taken(&run, BeaconMclDrive::truth(now), ros::Time(), 400);
}

TEST(SetParticles, FastSlamGoesOnFromThemInItsMap) {
  FastSlamRig run;
  run.feed(FastSlamDrive::messages(0.0, 12.0));
  expect_taken(&run, FastSlamDrive::truth(FastSlamDrive::at(12.0)), FastSlamDrive::at(12.0), 60);
  EXPECT_LT(run.map_error(), 0.5);
}

TEST(SetParticles, TheyHoldAtTheirStamp) {
  Rig run;
  run.feed(BeaconMclDrive::messages(0.0, 12.0));
  const ros::Time before(BeaconMclDrive::kStart + 11.0);
  geometry_msgs::PoseArray array = poses_about(BeaconMclDrive::truth(before), 1);
  array.header.stamp = before;
  run.pipeline.set_particles(array, {2.0});
  const Pose2 truth = BeaconMclDrive::truth(ros::Time(BeaconMclDrive::kStart + 12.0));
  EXPECT_NEAR(run.pipeline.estimate()->mean.x, truth.x, 0.02);
  EXPECT_NEAR(run.pipeline.estimate()->mean.y, truth.y, 0.02);
}

template <typename AnyRig>
std::string refusal(AnyRig* run, const geometry_msgs::PoseArray& array,
                    const std::vector<double>& weights) {
  try {
    run->pipeline.set_particles(array, weights);
  } catch (const Error& error) {
    return error.what();
  }
  return "taken";
}

const BeaconMclParticles& particles_of(const Rig& run) {
  return run.pipeline.filter()->particles();
}
const FastSlamParticles& particles_of(const FastSlamRig& run) {
  return run.pipeline.filter().particles();
}

// A run in which all that is wrong is tried out gives the same bytes as one without.
template <typename AnyRig, typename Drive>
void expect_refused() {
  AnyRig undisturbed;
  undisturbed.feed(Drive::messages(0.0, 20.0));
  AnyRig run;
  run.feed(Drive::messages(0.0, 12.0));
  const geometry_msgs::PoseArray good = poses_about({}, 3);
  const auto changed = [&](const std::function<void(geometry_msgs::PoseArray*)>& change) {
    geometry_msgs::PoseArray array = good;
    change(&array);
    return refusal(&run, array, {});
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::pair<std::string, std::string> cases[] = {
      {changed([](auto* a) { a->header.frame_id = "odom"; }), "the frame is 'odom'; give the"},
      {changed([](auto* a) { a->poses.clear(); }), "there are 0 particles; give at least one"},
      {changed([](auto* a) { a->poses.resize(1000001, a->poses[0]); }), "there are 1000001 part"},
      {changed([&](auto* a) { a->poses[1].position.y = nan; }), "particle 1 is at (0 m, nan m"},
      {changed([&](auto* a) { a->poses[1].orientation.w = nan; }), "particle 1 is at (0 m, 0 m, n"},
      {changed([](auto* a) { a->poses[2].orientation.w = 0.0; }), "of particle 2 is not of length"},
      {changed([](auto* a) { a->header.stamp = ros::Time(5.0); }), "no odometry is kept for the"},
      {changed([](auto* a) { a->header.stamp = ros::Time(500.0); }), "for the stamp 500.000000"},
      {refusal(&run, good, {1.0, 1.0}), "there are 2 weights for 3 particles; give"},
      {refusal(&run, good, {1.0, nan, 1.0}), "the weight of particle 1 is nan; give"},
      {refusal(&run, good, {1.0, 1.0, -2.0}), "the weight of particle 2 is -2; give"},
      {refusal(&run, good, {0.0, 0.0, 0.0}), "all weights are 0; give"},
  };
  for (const auto& [said, expected] : cases) {
    EXPECT_EQ(said.rfind("set_particles: ", 0), 0u) << said;
    EXPECT_TRUE(says(said, expected));
    EXPECT_FALSE(says(said, "\n"));
  }
  go_on(&run, 12.0, 20.0);
  EXPECT_TRUE(same_bytes(run.out.poses, undisturbed.out.poses));
  EXPECT_TRUE(same_particles(particles_of(run), particles_of(undisturbed)));
}

TEST(SetParticles, BeaconMclRefusesWhatIsNoPopulationAndNothingChanges) {
  expect_refused<Rig, BeaconMclDrive>();
}

TEST(SetParticles, FastSlamRefusesWhatIsNoPopulationAndNothingChanges) {
  expect_refused<FastSlamRig, FastSlamDrive>();
}

TEST(SetParticles, BeaconMclNeedsItsBeaconsFirst) {
  Rig run;
  EXPECT_EQ(refusal(&run, poses_about({}, 3), {}),
            "set_particles: the beacons are not known yet; give them on the topic or in the "
            "configuration first");
}

}  // namespace
}  // namespace pf_resampling
