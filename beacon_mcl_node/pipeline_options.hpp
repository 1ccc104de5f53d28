#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "pf_resampling_core/filters/beacon_mcl/presets.hpp"
#include "pf_resampling_core/models/beacon_range.hpp"
#include "src/configuration/configuration.hpp"
#include "src/pipeline/pipeline_options.hpp"

namespace pf_resampling {

inline constexpr ObservationNames kRangeNames = {"ranges", "ranges", "the beacons",
                                                 "they come as the list `beacons` of the "
                                                 "configuration (beacons:=FILE of the launch "
                                                 "file), or on the topic beacons",
                                                 "localization"};

/// Everything that can be configured about range-beacon localization under ROS.
struct BeaconMclPipelineOptions : PipelineOptions {
  BeaconMclOptions filter;
  int max_beacons = 1000;  ///< that a BeaconArray or the configuration may have
  static constexpr double simultaneous = 0.001;  ///< s; ranges closer than this are one update
  std::string frame_pattern = "beacon_(\\d+)";   ///< of sensor_msgs/Range: id in the frame's name
  std::string antenna;  ///< frame they are measured from; empty: frames.base
  static constexpr double ring_lifetime = 1.5;  ///< s a range ring is shown

  std::vector<Beacon> beacons;               ///< if there are any, the `beacons` message is ignored
  std::map<std::string, int> beacon_frames;  ///< names of beacons, of sensor_msgs/Range
  std::map<int, RangeCalibration> calibration;      ///< known, by id of beacon; -1: all others
  std::map<std::string, Eigen::Vector3d> antennas;  ///< frame -> place on the robot, m

  BeaconMclPipelineOptions() {
    name = "beacon_mcl";
    preset = "balanced";
    filter = beacon_mcl_options_of(preset);
  }
};

/// The parameters of the filter, then those of the ROS side, bound to `options`.
ParameterList parameters_of(BeaconMclPipelineOptions* options);

/// Applies a configuration: values, beacons, antennas, calibration. Throws Error naming parameter,
/// value and range.
void apply(const Configuration& configuration, BeaconMclPipelineOptions* options);

}  // namespace pf_resampling
