#pragma once

#include <set>
#include <string>

#include "pf_resampling_core/parameters/presets.hpp"
#include "src/checkpoint/checkpoint_keeper.hpp"
#include "src/configuration/configuration.hpp"
#include "src/frames/frame_names.hpp"
#include "src/odometry/odometry_buffer.hpp"
#include "src/pipeline/belief_publisher.hpp"

namespace pf_resampling {

/// What the observations of a filter are called.
struct ObservationNames {
  const char* topic;   ///< "ranges"
  const char* plural;  ///< in sentences: "ranges"
  const char* needs;   ///< what has to be known before the first: "the beacons"; "": nothing
  const char* remedy;  ///< how it becomes known
  const char* task;    ///< what the filter does with them, in the diagnostics: "localization"
};

/// What can be configured about every filter under ROS, apart from the filter itself.
struct PipelineOptions {
  std::string preset;           ///< whose values stand in place of the filter's defaults
  std::set<std::string> given;  ///< parameters that a configuration has set: no preset does

  OdometryBufferOptions odometry_input;
  int seed = 1;      ///< of all random numbers
  std::string name;  ///< in the diagnostics

  FrameNames frames;
  int queue_length = 100;    ///< observations that may wait: seconds of a fast sensor
  double max_ahead = 10.0;   ///< s that one may be newer than the odometry; more: another clock
  double max_latency = 1.0;  ///< s, old for a pose; see FilterPipeline::process_next()
  bool deferred = false;     ///< observations wait for process_next()

  CheckpointOptions checkpoint;
  std::string directory = "~/.ros/pf_resampling";  ///< of the files of services
  OutputOptions output;
};

/// Applies the values of a configuration to `parameters`, which are of `options`. What it gives, it
/// gives for good: a preset that this or another configuration names sets what none of them gives.
/// `presets`, `defaults`: of the filter. Throws Error naming parameter, value and range.
void apply_values(const Configuration& configuration, const PresetList& presets,
                  const ParameterList& defaults, const ParameterList& parameters,
                  PipelineOptions* options);

/// map_file/directory.
Parameter directory_parameter(PipelineOptions* options);

/// Adds them as parameters: what is about input, and what is about output. Between them a filter
/// adds what it alone knows about its input.
void add_input_parameters(PipelineOptions* options, ParameterList* list);
void add_output_parameters(PipelineOptions* options, ParameterList* list);

}  // namespace pf_resampling
