#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "pf_resampling_core/filters/beacon_mcl/saved_beacon_mcl.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"
#include "src/odometry/saved_progress.hpp"

namespace pf_resampling {

/// All that a filter needs to go on as if nothing had happened, with the same configuration and
/// seed; but for observations that waited for odometry.
struct BeaconMclCheckpoint {
  SavedProgress progress;
  SavedBeaconMcl filter;
  /// Ids of beacons that were found to be wrong, and s, when.
  std::vector<int> found = {};
  std::vector<double> found_since = {};
};
struct FastSlamCheckpoint {
  SavedProgress progress;
  /// Where the robot has been and has seen landmarks, m, map frame.
  Eigen::AlignedBox2d scene = Eigen::AlignedBox2d(Eigen::Vector2d::Zero());
  SavedMap filter;
};

/// As they are saved, by write_saved() in a kCheckpointFile: see doc/saved_files.md.
void describe(Archive& archive, BeaconMclCheckpoint& checkpoint);
void describe(Archive& archive, FastSlamCheckpoint& checkpoint);

}  // namespace pf_resampling
