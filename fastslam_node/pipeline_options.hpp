#pragma once

#include <map>
#include <string>

#include "pf_resampling_core/filters/fastslam/options.hpp"
#include "pf_resampling_core/parameters/parameters.hpp"
#include "src/checkpoint/checkpoint_keeper.hpp"
#include "src/configuration/configuration.hpp"
#include "src/frames/frame_names.hpp"
#include "src/odometry/odometry_buffer.hpp"
#include "src/pipeline/belief_publisher.hpp"

namespace pf_resampling {

/// Everything that can be configured about FastSLAM under ROS.
struct FastSlamPipelineOptions {
  FastSlamOptions filter;
  OdometryBufferOptions odometry_input;
  int seed = 1;                   ///< of all random numbers
  std::string name = "fastslam";  ///< in the diagnostics

  CheckpointOptions checkpoint;
  FrameNames frames;
  OutputOptions output;
  double map_period = 1.0;    ///< s between landmark maps
  double map_min_held = 0.5;  ///< share of the weight that has to hold a landmark given out
  double label_height = 0.0;  ///< m, of the landmarks' ids; 0: chosen from the size of the map

  int queue_length = 100;               ///< scans that may wait for odometry
  double max_ahead = 10.0;              ///< s a scan may be newer than the newest odometry
  double max_latency = 1.0;             ///< s; see process_next()
  std::string tag_pattern;              ///< id in the names of tf frames of tags; empty: none
  bool deferred = false;                ///< what is observed waits for process_next()
  bool restart_after_jump_back = true;  ///< start anew, instead of with the last belief and map

  bool recovers = true;  ///< once lost, the robot is looked for where landmarks with ids are seen

  std::string map_file;           ///< read at the start; empty: none
  int map_file_particles = 1000;  ///< that a saved map holds at most

  /// Sensor frame -> pose on the robot (m, rad), for what no tf tells.
  std::map<std::string, Pose2> sensors;
};

/// The parameters of the filter, then those of the ROS side, bound to `options`.
ParameterList parameters_of(FastSlamPipelineOptions* options);

/// Of these what can be changed while it runs: the parameters of the filter.
ParameterList live_parameters_of(FastSlamPipelineOptions* options);

/// Applies a configuration: values and sensors. Throws Error naming parameter, value and range.
void apply(const Configuration& configuration, FastSlamPipelineOptions* options);

}  // namespace pf_resampling
