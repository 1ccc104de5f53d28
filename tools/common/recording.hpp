#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/models/beacon_range.hpp"
#include "pf_resampling_core/models/landmark_observation.hpp"

namespace pf_resampling {

/// Where the robot was at a time, or is believed to have been.
struct StampedPose {
  double time = 0.0;  ///< s
  Pose2 pose;
};

/// A range with its time and the frame of the antenna.
struct StampedRange {
  double time = 0.0;  ///< s
  std::string frame;
  int beacon = 0;
  double range = 0.0;  ///< m
};

struct PointLandmark {
  std::int32_t id = -1;
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  ///< m, map frame
};

/// The landmarks of one scan, with its time and the frame of the sensor.
struct StampedScan {
  double time = 0.0;  ///< s
  std::string frame;
  std::vector<RangeBearingObservation> landmarks;
};

/// White noise of the odometry, as standard deviations that grow with the root of the time.
struct StatedOdometryNoise {
  double along = 0.0;    ///< m per sqrt(s), ahead
  double across = 0.0;   ///< m per sqrt(s), to the side
  double heading = 0.0;  ///< rad per sqrt(s)
};

/// What a robot recorded on a drive. Times in s, on one clock; each list in order of time, of
/// finite numbers.
struct Recording {
  std::vector<StampedPose> odometry;                  ///< in a frame of its own
  std::optional<StatedOdometryNoise> odometry_noise;  ///< if it is stated
  std::vector<StampedRange> ranges;
  std::vector<Beacon> beacons;                      ///< whose place is known; map frame
  std::vector<StampedScan> scans;                   ///< of landmarks; ids of -1 are unknown
  std::map<std::string, Eigen::Isometry3d> frames;  ///< where antennas and sensors sit on the robot
};

/// A path at a time: between two poses the position is linear, the heading on the shorter arc;
/// before and after it the pose stays as it is there.
Pose2 pose_at(const std::vector<StampedPose>& path, double time);

/// In the plane.
inline Pose2 to_pose2(const Eigen::Isometry3d& frame) {
  const Eigen::Matrix3d turn = frame.linear();
  return {frame.translation().x(), frame.translation().y(), std::atan2(turn(1, 0), turn(0, 0))};
}

}  // namespace pf_resampling
