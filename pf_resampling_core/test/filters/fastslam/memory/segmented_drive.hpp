#pragma once

#include "pf_resampling_core/filters/fastslam/memory/memory.hpp"
#include "pf_resampling_core/smoothing/smoothing_graph.hpp"

namespace pf_resampling {

/// A memory of a drive whose landmarks are numbered as they were seen, with these numbers for ids;
/// solved every 25 updates but for the last `unsolved`.
inline Memory remembered(const SmoothingGraph& drive, double robust_width, int unsolved = 0) {
  Memory memory;
  memory.start(drive.poses.front(), SensorConstants::Zero());
  std::size_t next = 0;
  const int updates = static_cast<int>(drive.motions.size());
  for (int i = 1; i <= updates; ++i) {
    memory.append(drive.motions[static_cast<std::size_t>(i) - 1]);
    for (; next < drive.sightings.size() && drive.sightings[next].pose == i; ++next) {
      memory.append_sighting(drive.sightings[next].landmark, drive.sightings[next]);
    }
    if (i % 25 == 0 && i <= updates - unsolved) memory.solve(robust_width);
  }
  if (unsolved == 0) memory.solve(robust_width);
  return memory;
}

}  // namespace pf_resampling
