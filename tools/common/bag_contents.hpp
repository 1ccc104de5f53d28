#pragma once

#include <rosbag/bag.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pf_resampling_core/models/beacon_range.hpp"
#include "src/frames/frame_names.hpp"
#include "tools/common/stamped_pose.hpp"

namespace pf_resampling {

/// What a bag says about places, as plain values. Stamps are those of the headers (of the bag where
/// a header has none); all lists are in order of their stamps. The topic's presence is the caller's
/// to check (require_topics); a message that cannot be used is an Error that names topic and time.

/// Message types that read_poses() takes.
std::vector<std::string> pose_types();

/// Of these.
std::vector<StampedPose> read_poses(const rosbag::Bag& bag, const std::string& topic);

/// Dead reckoning, without what filters reject of it.
struct RecordedOdometry {
  std::vector<StampedPose> poses;
  std::string left_out;  ///< how many messages, and why the first; empty: none
};
/// Of the types of read_poses(), or from odom to base on a topic of tf2_msgs/TFMessage. Throws
/// Error if that leaves no pose.
RecordedOdometry read_odometry(const rosbag::Bag& bag, const std::string& topic,
                               const FrameNames& frames = {});

/// The beacons of the last message on a topic of BeaconArray; none if there is none. A height
/// of NaN says that the beacon is as high as the antenna.
std::vector<Beacon> read_beacons(const rosbag::Bag& bag, const std::string& topic);

/// A range with its time and the frame of the antenna.
struct StampedRange {
  double time = 0.0;  ///< s
  std::string frame;
  int beacon = 0;
  double range = 0.0;  ///< m
};
/// Message types that read_ranges() takes: those of drivers, too, which name no frame, and
/// sensor_msgs/Range of frames with the usual names.
std::vector<std::string> recorded_range_types();
std::vector<StampedRange> read_ranges(const rosbag::Bag& bag, const std::string& topic);

struct PointLandmark {
  std::int32_t id = -1;
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  ///< m, map frame
};
/// The landmarks of the last message on a topic of LandmarkMap; nothing if there is none.
std::optional<std::vector<PointLandmark>> read_landmark_map(const rosbag::Bag& bag,
                                                            const std::string& topic);
/// The poses of the last message on a topic of nav_msgs/Path; nothing if there is none.
std::optional<std::vector<StampedPose>> read_path(const rosbag::Bag& bag, const std::string& topic);

/// What a sensor saw of one landmark.
struct SeenLandmark {
  std::int32_t id = -1;           ///< -1: unknown
  double range = 0.0;             ///< m
  double bearing = 0.0;           ///< rad, in the sensor's frame
  double range_variance = 0.0;    ///< m^2; 0: unknown
  double bearing_variance = 0.0;  ///< rad^2; 0: unknown
};
/// The landmarks of one scan, with its time and the frame of the sensor.
struct StampedScan {
  double time = 0.0;  ///< s
  std::string frame;
  std::vector<SeenLandmark> landmarks;
};
/// Of landmark_types(). Tags are seen from base_link; a camera that /tf_static does not place sees
/// none.
std::vector<StampedScan> read_landmark_scans(const rosbag::Bag& bag, const std::string& topic);

/// White noise of the odometry, as standard deviations that grow with the root of the time.
struct StatedOdometryNoise {
  double along = 0.0;    ///< m per sqrt(s), ahead
  double across = 0.0;   ///< m per sqrt(s), to the side
  double heading = 0.0;  ///< rad per sqrt(s)
};
/// From the covariances of the twists (nav_msgs/Odometry), each that of the mean velocity since the
/// message before; nothing if none is stated.
std::optional<StatedOdometryNoise> read_odometry_noise(const rosbag::Bag& bag,
                                                       const std::string& topic);

/// Where the frames of /tf_static sit on the robot, in the frame `base`, as the nodes find them:
/// going up from a frame to `base`. The newest transform of a frame counts.
std::map<std::string, Eigen::Isometry3d> read_frames_on_robot(const rosbag::Bag& bag,
                                                              const std::string& base);

}  // namespace pf_resampling
