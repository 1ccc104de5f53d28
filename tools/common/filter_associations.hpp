#pragma once

#include <vector>

#include "tools/common/recording.hpp"

namespace pf_resampling {

/// What a filter has in the end made of observations without ids.
struct FilterResult {
  std::vector<StampedPose> path;   ///< as believed at the end, in order of time
  std::vector<PointLandmark> map;  ///< in the same frame
};

/// The scans with ids of the landmarks that they are of by that path and map: each is of the
/// nearest landmark within half of the median distance between neighbours (at least 0.5 m): what is
/// farther off might as well be the neighbour. The nearest first, no landmark twice in a scan;
/// others get -1. Between the path's poses the robot goes as the odometry says, and what is then
/// missing to the next pose is added in proportion to the time. Scans of frames that are not on the
/// robot stay as they are. Throws Error for a path or odometry that is none.
std::vector<StampedScan> associated_by(const FilterResult& result, const Recording& recording);

}  // namespace pf_resampling
