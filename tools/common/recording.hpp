#pragma once

#include <rosbag/bag.h>

#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "src/frames/frame_names.hpp"
#include "tools/common/bag_contents.hpp"

namespace pf_resampling {

/// What a robot recorded on a drive. Times in s, on one clock; each list in order of time.
struct Recording {
  std::vector<StampedPose> odometry;                  ///< in a frame of its own
  std::optional<StatedOdometryNoise> odometry_noise;  ///< if it is stated
  std::vector<StampedRange> ranges;
  std::vector<Beacon> beacons;                      ///< whose place is known; map frame
  std::vector<StampedScan> scans;                   ///< of landmarks; ids of -1 are unknown
  std::map<std::string, Eigen::Isometry3d> frames;  ///< where antennas and sensors sit on the robot
};

/// Of a bag: odometry, ranges and scans of these topics, as far as they are there, and the frames
/// of /tf_static. Throws Error without odometry.
Recording read_recording(const rosbag::Bag& bag, const std::string& odometry,
                         const std::string& ranges, const std::string& landmarks,
                         const FrameNames& frames = {});

/// In the plane.
Pose2 to_pose2(const Eigen::Isometry3d& frame);

}  // namespace pf_resampling
