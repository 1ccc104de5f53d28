#pragma once

#include <vector>

#include "pf_resampling_core/range_memory/range_memory.hpp"
#include "tools/common/batch_slam.hpp"
#include "tools/common/recording.hpp"

namespace pf_resampling {

struct RangeSolution {
  RangeMemory memory;  ///< with all data
  /// At the stamps of the odometry, in the frame of the beacons; in that of the first pose where
  /// fewer than two are known. From all data, but as `online` for what has left the memory.
  std::vector<StampedPose> path;
  OnlineSolution online;  ///< what could be known while the robot drove
  int ranges = 0;         ///< that took part
  int outliers = 0;       ///< of these, farther off than 4 standard deviations
};

/// The path, places of radios that are not known, and errors of radios, antenna and odometry that
/// fit all data best at once: see RangeMemory. Throws Error if there is no solution, or no
/// odometry.
RangeSolution solve_ranges(const Recording& drive);

}  // namespace pf_resampling
