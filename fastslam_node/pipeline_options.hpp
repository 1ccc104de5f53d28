#pragma once

#include <map>
#include <string>

#include "pf_resampling_core/filters/fastslam/presets.hpp"
#include "pf_resampling_core/geometry.hpp"
#include "src/configuration/configuration.hpp"
#include "src/pipeline/pipeline_options.hpp"

namespace pf_resampling {

inline constexpr ObservationNames kScanNames = {"landmarks", "scans", "", "", "mapping"};

inline constexpr const char* kDefaultFastSlamPreset = "balanced";

/// Everything that can be configured about FastSLAM under ROS.
struct FastSlamPipelineOptions : PipelineOptions {
  FastSlamOptions filter;
  static constexpr int max_observations = 1000;  ///< of a scan; it bounds the time of an update
  std::string tag_pattern;          ///< id in the names of tf frames of tags; empty: none
  std::string map_file;             ///< read at the start; empty: none
  bool starts_anywhere = false;     ///< in the map that is loaded: the robot is to be found
  bool starts_without_map = false;  ///< when that cannot be used: for nodes, which are not to end
  static constexpr int map_file_particles = 1000;  ///< that a saved map holds at most
  double map_period = 1.0;                         ///< s between landmark maps
  double map_min_held = 0.5;  ///< share of the weight that has to hold a landmark given out

  /// Sensor frame -> pose on the robot (m, rad), for what no tf tells.
  std::map<std::string, Pose2> sensors;

  FastSlamPipelineOptions() : FastSlamPipelineOptions(kDefaultFastSlamPreset) {}
  /// With the values of one of the fastslam_presets().
  explicit FastSlamPipelineOptions(const std::string& preset_name);
};

/// The parameters of the filter, then those of the ROS side, bound to `options`.
ParameterList parameters_of(FastSlamPipelineOptions* options);

/// Applies a configuration: values and sensors. Throws Error naming parameter, value and range.
void apply(const Configuration& configuration, FastSlamPipelineOptions* options);

}  // namespace pf_resampling
