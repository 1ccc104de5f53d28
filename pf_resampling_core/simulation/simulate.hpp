#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/simulation/sensors.hpp"
#include "pf_resampling_core/simulation/world.hpp"

namespace pf_resampling {

/// A simulated drive: times in seconds from its start, each list in order of time.
struct SimulatedDrive {
  struct Odometry {
    double time = 0.0;
    Pose2 truth;       ///< map frame
    Pose2 pose;        ///< dead reckoning, from (0, 0, 0)
    Control measured;  ///< during the last control period
  };
  struct Range {
    double time = 0.0;
    int beacon = 0;      ///< id
    double range = 0.0;  ///< m
  };
  struct Scan {
    double time = 0.0;
    std::vector<SimulatedLandmarkObservation> observations;
  };

  std::vector<Odometry> odometry;  ///< the first at time 0
  std::vector<Range> ranges;
  std::vector<Scan> scans;
  std::map<std::string, double> closures;  ///< name, time when its way-point became the target
};

/// Drives through a world. The same world and seed give the same numbers. Truth at the time of an
/// observation between two controls is on the arc between them. Throws Error when the world makes
/// no sense (check_world).
SimulatedDrive simulate(const World& world, std::uint64_t seed);

}  // namespace pf_resampling
