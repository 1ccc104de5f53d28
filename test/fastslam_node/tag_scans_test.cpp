// Tags that detectors publish as tf frames, as landmarks of FastSLAM.
#include "fastslam_node/tag_scans.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "test/fastslam_rig.hpp"
#include "test/run_program.hpp"
#include "tools/common/bag_writer.hpp"

namespace pf_resampling {
namespace {

const char* const kPattern = "tag_(\\d+)";
// Where the camera looks from above: x, y (m), heading (rad); and its height, m.
constexpr double kCameraX = 0.2;
constexpr double kCameraY = -0.1;
constexpr double kCameraYaw = 0.5;
constexpr double kCameraHeight = 1.2;

geometry_msgs::TransformStamped transform_of(const std::string& parent, const std::string& child,
                                             const Eigen::Isometry3d& pose, ros::Time stamp) {
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = parent;
  transform.header.stamp = stamp;
  transform.child_frame_id = child;
  transform.transform.translation.x = pose.translation().x();
  transform.transform.translation.y = pose.translation().y();
  transform.transform.translation.z = pose.translation().z();
  const Eigen::Quaterniond turn(pose.linear());
  transform.transform.rotation.x = turn.x();
  transform.transform.rotation.y = turn.y();
  transform.transform.rotation.z = turn.z();
  transform.transform.rotation.w = turn.w();
  return transform;
}

/// A camera's optical frame (z where it looks, x to the right, y down) on the robot: looking along
/// `yaw`, bent down by `pitch`.
Eigen::Isometry3d camera_on_robot(double yaw = kCameraYaw, double pitch = 0.35) {
  Eigen::Matrix3d optical;
  optical << 0, 0, 1, -1, 0, 0, 0, -1, 0;  // columns: its axes in a frame with x ahead, z up
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Eigen::Vector3d(kCameraX, kCameraY, kCameraHeight);
  pose.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d(0, 0, 1)).toRotationMatrix() *
                  Eigen::AngleAxisd(pitch, Eigen::Vector3d(0, 1, 0)).toRotationMatrix() * optical;
  return pose;
}

Pose2 camera_from_above() {
  return {kCameraX, kCameraY, kCameraYaw};
}

/// Where the camera sees a landmark of the drive, whose tag hangs at a height of its own.
geometry_msgs::TransformStamped sighting(int id, ros::Time stamp) {
  const Pose2 robot = FastSlamDrive::truth(stamp);
  const Eigen::Isometry3d map_to_robot = Eigen::Translation3d(robot.x, robot.y, 0.0) *
                                         Eigen::AngleAxisd(robot.heading, Eigen::Vector3d(0, 0, 1));
  const Eigen::Vector2d place = FastSlamDrive::landmarks()[static_cast<std::size_t>(id)];
  Eigen::Isometry3d tag = Eigen::Isometry3d::Identity();
  tag.translation() = Eigen::Vector3d(place.x(), place.y(), 0.3 * id);
  return transform_of("camera", "tag_" + std::to_string(id),
                      (map_to_robot * camera_on_robot()).inverse() * tag, stamp);
}

tf2_msgs::TFMessage::ConstPtr message_of(
    const std::vector<geometry_msgs::TransformStamped>& transforms) {
  auto message = boost::make_shared<tf2_msgs::TFMessage>();
  message->transforms = transforms;
  return message;
}

FastSlamMessage camera_place() {
  return message_of({transform_of("base_link", "camera", camera_on_robot(), ros::Time(99.0))});
}

/// The drive with what is seen of landmarks as tags, each in a message of its own.
std::vector<FastSlamMessage> tag_drive(double seconds) {
  std::vector<FastSlamMessage> all = {camera_place()};
  for (const FastSlamMessage& message : FastSlamDrive::messages(seconds)) {
    const auto* scan = std::get_if<LandmarkObservationArray::ConstPtr>(&message);
    if (scan == nullptr) {
      all.push_back(message);
      continue;
    }
    for (const auto& seen : (*scan)->observations) {
      all.emplace_back(message_of({sighting(seen.id, (*scan)->header.stamp)}));
    }
  }
  return all;
}

FastSlamPipelineOptions tag_options() {
  FastSlamPipelineOptions options = FastSlamDrive::options();
  options.tag_pattern = kPattern;
  return options;
}

/// Tags of one camera that sits on the robot's frame, for tests of what is a scan.
struct Detector {
  Detector() { on_robot.add("base_link", "camera", {kCameraX, 0.0, 0.0}); }

  std::optional<Rejection> see(const std::string& tag, double stamp, double odometry,
                               const std::string& camera = "camera") {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = Eigen::Vector3d(3.0, 4.0, 1.0);
    return tags.take(transform_of(camera, tag, pose, ros::Time(stamp)), ros::Time(odometry),
                     &on_robot);
  }
  std::vector<std::size_t> complete(double odometry) {
    std::vector<std::size_t> sizes;
    for (const auto& scan : tags.take_complete(ros::Time(odometry))) {
      sizes.push_back(scan.observations.size());
    }
    return sizes;
  }

  StaticFrames on_robot;
  TagScans tags{FramePattern(kPattern), FrameNames()};
};

using Sizes = std::vector<std::size_t>;

TEST(TagScans, TheTagsOfAnImageAreAScan) {
  Detector detector;
  EXPECT_FALSE(detector.see("tag_1", 10.0, 10.02));
  EXPECT_FALSE(detector.see("tag_2", 10.0, 10.02));
  EXPECT_EQ(detector.complete(10.04), Sizes{}) << "more of them may come";
  EXPECT_FALSE(detector.see("tag_3", 10.0, 10.04));
  EXPECT_EQ(detector.complete(10.06), Sizes{});
  EXPECT_EQ(detector.complete(10.08), Sizes{3});
  EXPECT_EQ(detector.complete(10.2), Sizes{});

  EXPECT_FALSE(detector.see("tag_1", 10.2, 10.22));
  EXPECT_FALSE(detector.see("tag_1", 10.3, 10.22));
  EXPECT_EQ(detector.complete(10.22), Sizes{1}) << "the next image has come";
  EXPECT_EQ(detector.complete(10.5), Sizes{1});
}

TEST(TagScans, EachCameraHasItsOwn) {
  Detector detector;
  detector.on_robot.add("base_link", "rear", {-0.2, 0.0, 0.0}, kPi);
  EXPECT_FALSE(detector.see("tag_1", 10.0, 10.0));
  EXPECT_FALSE(detector.see("tag_1", 10.01, 10.0, "rear"));
  EXPECT_FALSE(detector.see("tag_2", 10.0, 10.0));
  std::map<std::string, std::size_t> sizes;
  for (const auto& scan : detector.tags.take_complete(ros::Time(11.0))) {
    sizes[scan.header.frame_id] = scan.observations.size();
  }
  EXPECT_EQ(sizes,
            (std::map<std::string, std::size_t>{{"camera from above", 2}, {"rear from above", 1}}));
}

TEST(TagScans, WhatARelayRepeatsIsPassedOver) {
  Detector detector;
  EXPECT_FALSE(detector.see("tag_1", 10.0, 10.0));
  EXPECT_FALSE(detector.see("tag_1", 10.0, 10.0));
  EXPECT_EQ(detector.complete(10.1), Sizes{1});
  EXPECT_FALSE(detector.see("tag_1", 10.0, 10.1));
  EXPECT_EQ(detector.complete(11.0), Sizes{});
}

TEST(StaticFrames, WhatGoesInACircleIsNowhere) {
  StaticFrames frames;
  const auto join = [&](const std::string& parent, const std::string& child) {
    return frames.add(transform_of(parent, child, Eigen::Isometry3d::Identity(), ros::Time(1.0)));
  };
  ASSERT_TRUE(join("mast", "camera"));
  ASSERT_TRUE(join("arm", "mast"));
  ASSERT_TRUE(join("camera", "arm"));
  EXPECT_FALSE(frames.pose("base_link", "camera"));
  EXPECT_FALSE(frames.pose("base_link", "mast"));
  ASSERT_TRUE(join("base_link", "arm")) << "the circle is broken";
  EXPECT_TRUE(frames.pose("base_link", "camera"));
}

TEST(TagScans, WhatIsNoDetectionIsNoTag) {
  const auto is_tag = [](const std::string& parent, const std::string& child,
                         const std::string& pattern = kPattern) {
    return TagScans(FramePattern(pattern), FrameNames())
        .is_tag(transform_of(parent, child, Eigen::Isometry3d::Identity(), ros::Time(1.0)));
  };
  EXPECT_TRUE(is_tag("camera", "tag_7"));
  EXPECT_TRUE(is_tag("/camera", "/tag_7"));
  EXPECT_FALSE(is_tag("camera", "tag_bundle"));
  EXPECT_FALSE(is_tag("map", "tag_7"));
  EXPECT_FALSE(is_tag("/odom", "tag_7"));
  EXPECT_FALSE(is_tag("camera", "tag_7", "")) << "off by default";
  EXPECT_TRUE(FastSlamPipelineOptions().tag_pattern.empty());
}

TEST(TagScans, WhatCannotBeUsedIsRejectedWithTheReason) {
  Detector detector;
  EXPECT_EQ(detector.see("tag_1", 10.0, 10.0, "helicopter")->reason, RejectReason::unknown_frame);
  EXPECT_EQ(detector.see("tag_1", 0.0, 10.0)->reason, RejectReason::no_stamp);
  auto broken = transform_of("camera", "tag_1", Eigen::Isometry3d::Identity(), ros::Time(10.0));
  broken.transform.translation.y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(detector.tags.take(broken, ros::Time(10.0), &detector.on_robot)->reason,
            RejectReason::not_finite);
  EXPECT_EQ(detector.complete(11.0), Sizes{});
}

/// Range and bearing of a tag 3 m ahead of the robot and 1 m to its left, 2 m high, as a camera
/// there sees it; and where the camera looks.
struct Seen {
  double range, bearing, heading;
};
Seen seen_by(const Eigen::Isometry3d& camera) {
  StaticFrames on_robot;
  EXPECT_TRUE(on_robot.add(transform_of("base_link", "camera", camera, ros::Time(1.0))));
  Eigen::Isometry3d tag = Eigen::Isometry3d::Identity();
  tag.translation() = Eigen::Vector3d(3.0, 1.0, 2.0);
  TagScans tags{FramePattern(kPattern), FrameNames()};
  EXPECT_FALSE(tags.take(transform_of("camera", "tag_5", camera.inverse() * tag, ros::Time(10.0)),
                         ros::Time(10.0), &on_robot));
  const auto scans = tags.take_complete(ros::Time(11.0));
  EXPECT_EQ(scans.size(), 1u);
  EXPECT_EQ(scans[0].observations[0].id, 5);
  const auto sensor = on_robot.pose("base_link", scans[0].header.frame_id);
  EXPECT_NEAR(sensor->translation().x(), kCameraX, 1e-12);
  EXPECT_NEAR(sensor->translation().y(), kCameraY, 1e-12);
  EXPECT_NEAR((sensor->linear() * Eigen::Vector3d(0, 0, 1)).z(), 1.0, 1e-12);
  return {scans[0].observations[0].range, scans[0].observations[0].bearing,
          std::atan2(sensor->linear()(1, 0), sensor->linear()(0, 0))};
}

TEST(TagScans, RangeAndBearingAreThoseInThePlaneHoweverTheCameraIsMounted) {
  const double range = std::hypot(3.0 - kCameraX, 1.0 - kCameraY);
  const double direction = std::atan2(1.0 - kCameraY, 3.0 - kCameraX);
  for (const double yaw : {0.0, 0.5, -2.0, 3.0}) {
    for (const double pitch : {0.0, 0.35, -0.6, 1.2}) {
      const Seen seen = seen_by(camera_on_robot(yaw, pitch));
      EXPECT_NEAR(seen.heading, yaw, 1e-12) << pitch;
      EXPECT_NEAR(seen.range, range, 1e-12);
      EXPECT_NEAR(wrap_angle(seen.bearing + seen.heading - direction), 0.0, 1e-12);
    }
    const Seen down = seen_by(camera_on_robot(yaw, kPi / 2.0));
    EXPECT_NEAR(down.heading, yaw, 1e-9) << "straight down, its upper edge ahead";
    EXPECT_NEAR(down.range, range, 1e-12);
    EXPECT_NEAR(wrap_angle(down.bearing + down.heading - direction), 0.0, 1e-12);

    // A frame as the robot's own: x ahead, z up.
    Eigen::Isometry3d upright = camera_on_robot();
    upright.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d(0, 0, 1)).toRotationMatrix();
    const Seen level = seen_by(upright);
    EXPECT_NEAR(level.heading, yaw, 1e-12);
    EXPECT_NEAR(level.bearing, wrap_angle(direction - yaw), 1e-12);
  }
}

TEST(TagScans, ThePipelineDoesWithTagsWhatItDoesWithItsOwnMessages) {
  FastSlamPipelineOptions options = tag_options();
  FastSlamRig tags(options);
  tags.feed(tag_drive(30.0));
  EXPECT_EQ(tags.pipeline.rejects().total(), 0u);
  EXPECT_LT(tags.error(), 0.3);
  EXPECT_LT(tags.map_error(), 0.3);
  EXPECT_EQ(tags.out.maps.back().landmarks.size(), FastSlamDrive::landmarks().size());

  // The same sightings as scans of a sensor that is where the camera is from above: a scan for
  // each image, and poses that agree as far as roundings let them.
  options.sensors["sensor"] = camera_from_above();
  FastSlamRig scans(options);
  scans.feed(changed<LandmarkObservationArray>(FastSlamDrive::messages(30.0), [](auto* scan) {
    scan->header.frame_id = "sensor";
    for (auto& seen : scan->observations) {
      seen = FastSlamDrive::observation(scan->header.stamp, seen.id, camera_from_above());
    }
  }));
  ASSERT_GT(scans.out.updates.size(), 140u);
  EXPECT_EQ(tags.out.updates, scans.out.updates);
  ASSERT_EQ(tags.out.poses.size(), scans.out.poses.size());
  EXPECT_LT(distance(tags.pose(), to_pose2(scans.out.poses.back().pose.pose)), 1e-6);
}

TEST(TagScans, WithoutAPatternTagsAreFramesLikeAnyOther) {
  FastSlamRig rig;
  rig.feed(tag_drive(5.0));
  EXPECT_TRUE(rig.out.updates.empty());
  EXPECT_EQ(rig.pipeline.rejects().total(), 0u);
}

TEST(TagScans, ADetectionBeforeTheCameraIsKnownIsCountedAndShown) {
  FastSlamRig rig(tag_options());
  rig.feed(FastSlamDrive::messages(1.0));
  rig.pipeline.handle(*message_of({sighting(1, FastSlamDrive::at(0.9))}));
  EXPECT_EQ(rig.rejected("landmarks", RejectReason::unknown_frame), 1u);
  EXPECT_TRUE(rig.has_said("camera"));
  rig.pipeline.report_silence(FastSlamDrive::at(3.0));
  EXPECT_NE(value_of(rig.out.diagnostics.back(), "rejected landmarks unknown_frame"), "");
}

TEST(TagScans, TheBagThatIsPlayedAgainIsTakenAgain) {
  FastSlamRig rig(tag_options());
  rig.feed(tag_drive(10.0));
  const std::size_t once = rig.out.updates.size();
  rig.feed(tag_drive(10.0));
  EXPECT_GE(rig.out.updates.size(), 2 * once - 5) << "the first few confirm that time jumped";
}

TEST(TagScans, RunBagTakesThemFromTf) {
  const TemporaryDirectory directory;
  const std::string in = directory.file("in.bag");
  BagWriter bag(in);
  ros::Time now(99.0);
  for (const FastSlamMessage& message : tag_drive(35.0)) {
    if (const auto* odometry = std::get_if<nav_msgs::Odometry::ConstPtr>(&message)) {
      now = (*odometry)->header.stamp;
      bag.write("/odom", now, **odometry);
    } else if (const auto* tf = std::get_if<tf2_msgs::TFMessage::ConstPtr>(&message)) {
      const bool is_static = (*tf)->transforms[0].child_frame_id == "camera";
      if (!is_static) now = (*tf)->transforms[0].header.stamp;
      bag.write(is_static ? "/tf_static" : "/tf", now, **tf);
    }
  }
  bag.finish();
  const std::string line = "run_bag fastslam " + in + " " + directory.file("out.bag");
  EXPECT_TRUE(run_program(line).is_one_line_error("run_bag")) << "tags are off by default";
  const ProgramResult result = run_program(line + " --set 'landmark_input/tag_pattern=tag_(\\d+)'");
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_TRUE(says(result.out, "175 updates"));
  EXPECT_TRUE(says(result.out, "12 landmarks (known)"));
  EXPECT_FALSE(says(result.out, "rejected"));
}

}  // namespace
}  // namespace pf_resampling
