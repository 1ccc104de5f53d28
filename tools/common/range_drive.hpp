#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pf_resampling_core/range_memory/range_memory.hpp"
#include "tools/common/bag_contents.hpp"
#include "tools/common/batch_drive.hpp"

namespace pf_resampling {

/// What a robot measured that drove among radios.
struct RangeDrive {
  std::vector<EstimatedPose> odometry;                ///< in a frame of its own
  std::optional<StatedOdometryNoise> odometry_noise;  ///< if the recording states it
  std::vector<StampedRange> ranges;
  std::map<std::string, Eigen::Vector3d> antennas;  ///< where a range's frame sits on the robot
  std::vector<Beacon> beacons;                      ///< whose place is known; map frame
};

/// Of a bag: odometry, ranges, and what /tf_static says of antennas.
RangeDrive range_drive_of(const rosbag::Bag& bag, const std::string& odometry,
                          const std::string& ranges, const FrameNames& frames = {});

struct RangeSolution {
  RangeMemory memory;  ///< with all data
  /// At the stamps of the odometry, in the frame of the beacons; in that of the first pose where
  /// fewer than two are known. From all data, but as `online` for what has left the memory.
  std::vector<EstimatedPose> path;
  OnlineSolution online;  ///< what could be known while the robot drove
  int ranges = 0;         ///< that took part
  int outliers = 0;       ///< of these, farther off than 4 standard deviations
};

/// The path, places of radios that are not known, and errors of radios, antenna and odometry that
/// fit all data best at once: see RangeMemory. Ranges while there is no odometry are left out.
/// Throws Error if there is no solution, no range, a range's frame that is nowhere on the robot, or
/// more than memory can be expected to hold (check_size()).
RangeSolution solve_ranges(RangeDrive drive);

}  // namespace pf_resampling
