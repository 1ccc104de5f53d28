#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "pf_resampling_core/filters/beacon_mcl/options.hpp"
#include "pf_resampling_core/models/beacon_range.hpp"
#include "pf_resampling_core/parameters/parameters.hpp"
#include "src/checkpoint/checkpoint_keeper.hpp"
#include "src/configuration/configuration.hpp"
#include "src/frames/frame_names.hpp"
#include "src/odometry/odometry_buffer.hpp"
#include "src/pipeline/belief_publisher.hpp"

namespace pf_resampling {

/// Everything that can be configured about range-beacon localization under ROS.
struct BeaconMclPipelineOptions {
  BeaconMclOptions filter;
  OdometryBufferOptions odometry_input;
  int seed = 1;                     ///< of all random numbers
  std::string name = "beacon_mcl";  ///< in the diagnostics

  CheckpointOptions checkpoint;
  FrameNames frames;
  OutputOptions output;
  double ring_lifetime = 1.5;  ///< s a range ring is shown

  int queue_length = 100;                       ///< ranges that may wait for odometry or beacons
  double max_ahead = 10.0;                      ///< s a range may be newer than the newest odometry
  double simultaneous = 0.001;                  ///< s; ranges closer than this are one update
  double max_latency = 1.0;                     ///< s; see process_next()
  std::string frame_pattern = "beacon_(\\d+)";  ///< of sensor_msgs/Range: id in the frame's name
  std::string antenna;                  ///< frame they are measured from; empty: frames.base
  bool deferred = false;                ///< what is observed waits for process_next()
  bool restart_after_jump_back = true;  ///< start anew, instead of with the last belief

  std::vector<Beacon> beacons;               ///< if there are any, the `beacons` message is ignored
  std::map<std::string, int> beacon_frames;  ///< names of beacons, of sensor_msgs/Range
  std::map<int, RangeCalibration> calibration;      ///< known, by id of beacon; -1: all others
  std::map<std::string, Eigen::Vector3d> antennas;  ///< frame -> place on the robot, m
};

/// The parameters of the filter, then those of the ROS side, bound to `options`.
ParameterList parameters_of(BeaconMclPipelineOptions* options);

/// Of these what can be changed while it runs: the parameters of the filter.
ParameterList live_parameters_of(BeaconMclPipelineOptions* options);

/// Applies a configuration: values, beacons, antennas, calibration. Throws Error naming parameter,
/// value and range.
void apply(const Configuration& configuration, BeaconMclPipelineOptions* options);

}  // namespace pf_resampling
