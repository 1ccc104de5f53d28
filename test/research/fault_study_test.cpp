#include "research/studies/fault_study.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pf_resampling_core/error.hpp"
#include "src/messages/conversions.hpp"

namespace pf_resampling {
namespace {

// Straight along x at 1 m/s for 100 s among four beacons; odometry begins elsewhere.
RecordedDrive straight_drive(double start = 1000.0) {
  RecordedDrive drive;
  for (int i = 0; i < 4; ++i) {
    Beacon beacon;
    beacon.id = i + 1;
    beacon.is_planar = true;
    beacon.position = {i % 2 == 0 ? -10.0 : 110.0, i < 2 ? -20.0 : 20.0, 0.0};
    drive.beacons.push_back(beacon);
  }
  BeaconArray beacons;
  beacons.header.frame_id = "map";
  for (const Beacon& beacon : drive.beacons) {
    BeaconPosition position;
    position.id = beacon.id;
    position.position.x = beacon.position.x();
    position.position.y = beacon.position.y();
    position.position.z = std::nan("");
    beacons.beacons.push_back(position);
  }
  drive.messages.emplace_back(beacons);
  tf2_msgs::TFMessage antenna;
  antenna.transforms.resize(1);
  antenna.transforms[0].header.frame_id = "base_link";
  antenna.transforms[0].child_frame_id = "antenna";
  antenna.transforms[0].transform.rotation.w = 1.0;
  drive.messages.emplace_back(antenna);
  for (int step = 0; step <= 1000; ++step) {
    const double time = 0.1 * step;
    const ros::Time stamp(start + time);
    drive.truth.push_back({start + time, time, 0.0, 0.0});
    if (step % 2 == 0) {
      const Beacon& beacon = drive.beacons[static_cast<std::size_t>(step / 2 % 4)];
      BeaconRange range;
      range.header.stamp = stamp;
      range.header.frame_id = "antenna";
      range.beacon = beacon.id;
      range.range = std::hypot(time - beacon.position.x(), beacon.position.y());
      drive.messages.emplace_back(range);
    }
    nav_msgs::Odometry odometry;
    odometry.header.stamp = stamp;
    odometry.header.frame_id = "odom";
    odometry.child_frame_id = "base_link";
    odometry.pose.pose = to_pose_message(compose({3.0, 4.0, 1.0}, {time, 0.0, 0.0}));
    drive.messages.emplace_back(odometry);
  }
  return drive;
}

// For ten seconds.
bool is_good_at_the_end(const FaultRun& run, const FaultStudy& study) {
  return std::all_of(run.samples.end() - 10, run.samples.end(),
                     [&](const auto& sample) { return sample.error <= study.lost_error; });
}

// Cut where the robot is 40 m on: time goes on without a gap, odometry without a step.
TEST(FaultStudy, KidnappingJoinsTheDriveSeamlessly) {
  const Fault fault = kidnapped(straight_drive(), 1030.0, 40.0);
  double time = 0.0;
  Pose2 before;
  bool first = true;
  for (const DriveMessage& message : fault.drive.messages) {
    const auto* odometry = std::get_if<nav_msgs::Odometry>(&message);
    if (odometry == nullptr) continue;
    const Pose2 pose = to_pose2(odometry->pose.pose);
    const double stamp = odometry->header.stamp.toSec();
    if (!first) {
      EXPECT_LE(stamp - time, 0.1 + 1e-6);
      const Pose2 step = relative(before, pose);
      EXPECT_LE(std::hypot(step.x, step.y), 0.1 + 1e-6) << stamp;
      EXPECT_NEAR(step.heading, 0.0, 1e-9);
    }
    first = false;
    time = stamp;
    before = pose;
  }
  EXPECT_NEAR(time, 1060.0, 0.2);
  const auto truth = interpolate(fault.drive.truth, 1040.0, 1.0);
  ASSERT_TRUE(truth);
  EXPECT_NEAR(truth->x, 80.0, 0.2);
  EXPECT_THROW(kidnapped(straight_drive(), 1030.0, 500.0), Error);
}

// Simulated time begins at zero; a clock that is set back by 20 s then cannot be.
TEST(FaultStudy, ADriveMayBeginAtZero) {
  FaultStudyOptions options;
  options.share = 0.1;
  options.only = "the clock jumps";
  options.beacon_mcl.filter.particles = 300;
  const FaultStudy study = run_fault_study("straight", straight_drive(0.1), options);
  ASSERT_EQ(study.results.size(), 3u);
  for (const FaultResult& result : study.results) {
    EXPECT_TRUE(is_good_at_the_end(result.run, study)) << result.name;
  }
}

// Ranges and landmarks of the same ids: among beacons only ranges are read, and only they go wrong.
TEST(FaultStudy, ADriveMayHaveRangesAndLandmarks) {
  const RecordedDrive plain = straight_drive();
  RecordedDrive both = plain;
  both.messages.clear();
  for (const DriveMessage& message : plain.messages) {
    both.messages.push_back(message);
    const auto* range = std::get_if<BeaconRange>(&message);
    if (range == nullptr) continue;
    LandmarkObservationArray scan;
    scan.header.stamp = range->header.stamp;
    scan.observations.resize(2);
    for (auto& seen : scan.observations) seen.id = range->beacon == 1 ? 2 : range->beacon;
    both.messages.emplace_back(scan);
  }
  const RandomStream random(1, RandomPurpose::resampling, 0);
  const std::vector<Fault> expected = all_faults(plain, 0.25, random);
  const std::vector<Fault> faults = all_faults(both, 0.25, random);
  ASSERT_EQ(faults.size(), expected.size());
  for (std::size_t i = 0; i < faults.size(); ++i) {
    EXPECT_EQ(faults[i].name, expected[i].name);
    EXPECT_EQ(faults[i].drive.messages.size(), expected[i].drive.messages.size()) << faults[i].name;
  }
  RecordedDrive neither = plain;
  neither.messages.clear();
  for (const DriveMessage& message : plain.messages) {
    if (!std::holds_alternative<BeaconRange>(message)) neither.messages.push_back(message);
  }
  EXPECT_THROW(all_faults(neither, 0.25, random), Error);
}

// The sum of ros::Time throws there. 4294967295 s is the last second that a stamp can have.
TEST(FaultStudy, StampsAtTheEndOfTimeStayThere) {
  const std::vector<Fault> faults = all_faults(straight_drive(4294967295.0 - 200.0), 0.25,
                                               RandomStream(1, RandomPurpose::resampling, 0));
  const auto ahead = std::find_if(faults.begin(), faults.end(), [](const Fault& fault) {
    return fault.name == "one in ten: ranges an hour ahead";
  });
  ASSERT_NE(ahead, faults.end());
  std::uint32_t last = 0;
  for (const DriveMessage& message : ahead->drive.messages) {
    last = std::max(last, stamp_of(message).sec);
  }
  EXPECT_EQ(last, 4294967295U);
}

// A map turned by a quarter and shifted; two landmarks do not say how it lies.
TEST(FaultStudy, AMapTellsHowItsFrameLies) {
  const Pose2 frame{3.0, -1.0, 0.5 * kPi};
  std::vector<PointLandmark> truth, map;
  for (int i = 0; i < 3; ++i) {
    PointLandmark landmark;
    landmark.id = 6 + i;
    landmark.position = {4.0 * i, 1.0 * i * i};
    truth.push_back(landmark);
    EXPECT_EQ(map_to_truth(map, truth).has_value(), false);
    const Pose2 seen = relative(frame, {landmark.position.x(), landmark.position.y(), 0.0});
    landmark.position = {seen.x, seen.y};
    map.push_back(landmark);
  }
  const std::optional<Pose2> found = map_to_truth(map, truth);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->x, frame.x, 1e-9);
  EXPECT_NEAR(found->y, frame.y, 1e-9);
  EXPECT_NEAR(found->heading, frame.heading, 1e-9);
}

// On a drive with exact ranges every fault is one that the filter comes back from, nothing that is
// published is not finite, and what is said of bad messages comes at once.
TEST(FaultStudy, TheFilterComesBackFromEveryFault) {
  FaultStudyOptions options;
  options.share = 0.25;
  options.beacon_mcl.filter.particles = 300;
  const FaultStudy study = run_fault_study("straight", straight_drive(), options);
  EXPECT_GE(study.results.size(), 25u);
  for (const FaultResult& result : study.results) {
    EXPECT_TRUE(result.run.all_finite) << result.name;
    EXPECT_TRUE(is_good_at_the_end(result.run, study)) << result.name;
    if (result.name.find("one in ten: ranges of NaN") != std::string::npos) {
      ASSERT_TRUE(result.run.alarm);
      EXPECT_LT(result.run.alarm->delay, 10.0);
    }
  }
  EXPECT_EQ(to_json(run_fault_study("straight", straight_drive(), options)), to_json(study));
  options.only = "an hour ahead";
  const FaultStudy few = run_fault_study("straight", straight_drive(), options);
  ASSERT_EQ(few.results.size(), 4u);  // nothing, kidnapped, of ranges and of odometry
  EXPECT_EQ(few.results[3].name, "one in ten: odometry an hour ahead");
  for (const FaultRun::Sample& sample : few.results[3].run.samples) {
    EXPECT_TRUE(sample.time < few.results[3].begin || sample.error < study.lost_error);
  }
  options.only = "no such thing";
  EXPECT_THROW(run_fault_study("straight", straight_drive(), options), Error);
  options.only.clear();
  options.share = 2.0;
  EXPECT_THROW(run_fault_study("straight", straight_drive(), options), Error);
}

}  // namespace
}  // namespace pf_resampling
