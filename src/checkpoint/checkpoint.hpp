#pragma once

#include <Eigen/Geometry>
#include <string>

#include "pf_resampling_core/filters/beacon_mcl/saved_beacon_mcl.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"
#include "src/checkpoint/saved_progress.hpp"

namespace pf_resampling {

/// All that a filter needs to go on as if nothing had happened, with the same configuration and
/// seed; but for observations that waited for odometry.
struct BeaconMclCheckpoint {
  SavedProgress progress;
  SavedBeaconMcl filter;
};
struct FastSlamCheckpoint {
  SavedProgress progress;
  /// Where the robot has been and has seen landmarks, m, map frame.
  Eigen::AlignedBox2d scene = Eigen::AlignedBox2d(Eigen::Vector2d::Zero());
  SavedMap filter;
};

/// Writes a checkpoint as text: see doc/checkpoints.md. Numbers come back to the bit. The file
/// appears whole or not at all: written beside, synchronized, renamed. Throws Error, naming the
/// file, when it cannot be written or the state makes no sense.
void write_checkpoint(const std::string& path, const BeaconMclCheckpoint& checkpoint);
void write_checkpoint(const std::string& path, const FastSlamCheckpoint& checkpoint);

/// Read it. Throw Error, in one line that names file, line, fault and remedy, for anything that
/// write_checkpoint() has not written just so, and for a checkpoint of another filter.
BeaconMclCheckpoint read_beacon_mcl_checkpoint(const std::string& path);
FastSlamCheckpoint read_fastslam_checkpoint(const std::string& path);

}  // namespace pf_resampling
