#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "pf_resampling/configuration.hpp"
#include "pf_resampling/odometry_buffer.hpp"
#include "pf_resampling_core/beacon_mcl/options.hpp"
#include "pf_resampling_core/models/beacon_range.hpp"
#include "pf_resampling_core/parameters.hpp"

namespace pf_resampling {

/// Everything that can be configured about range-beacon localization under ROS.
struct BeaconMclPipelineOptions {
  BeaconMclOptions filter;
  OdometryBufferOptions odometry_input;
  int seed = 1;  ///< of all random numbers

  std::string map_frame = "map";
  std::string odom_frame = "odom";
  std::string base_frame = "base_link";
  double transform_tolerance = 0.2;  ///< s by which map -> odom is dated into the future

  int queue_length = 100;               ///< ranges that may wait for odometry or beacons
  double max_ahead = 10.0;              ///< s a range may be newer than the newest odometry
  double simultaneous = 0.001;          ///< s; ranges closer than this are one update
  bool restart_after_jump_back = true;  ///< start anew, instead of with the last belief

  double cloud_period = 0.5;        ///< s between particle clouds; 0: after every odometry message
  double marker_period = 0.5;       ///< s between markers
  double ring_lifetime = 1.5;       ///< s a range ring is shown
  double path_period = 2.0;         ///< s between paths
  double path_spacing = 0.5;        ///< m between poses of the path
  double path_max_sigma = 3.0;      ///< m; less certain positions are not put on the path
  int path_length = 10000;          ///< poses; a path that gets longer is thinned
  double diagnostics_period = 1.0;  ///< s between diagnostics

  std::vector<Beacon> beacons;  ///< if there are any, the `beacons` message is ignored
  std::map<int, RangeCalibration> calibration;      ///< known, by id of beacon; -1: all others
  std::map<std::string, Eigen::Vector3d> antennas;  ///< frame -> place on the robot, m
};

/// The parameters of the filter, then those of the ROS side, bound to `options`.
ParameterList parameters_of(BeaconMclPipelineOptions* options);

/// Applies a configuration: values, beacons, antennas, calibration. Throws Error naming parameter,
/// value and range.
void apply(const Configuration& configuration, BeaconMclPipelineOptions* options);

}  // namespace pf_resampling
