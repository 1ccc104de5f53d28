#include "src/pipeline/pipeline_options.hpp"

namespace pf_resampling {
namespace {

/// In the group "frames".
void add_frame_parameters(FrameNames* frames, ParameterList* list) {
  list->push_back(basic(
      name_parameter("frames/map", &frames->map, "Frame of the poses, beacons and landmarks.")));
  list->push_back(basic(name_parameter("frames/odom", &frames->odom,
                                       "Odometry frame: header.frame_id of the odometry.")));
  list->push_back(basic(name_parameter("frames/base", &frames->base,
                                       "Robot frame: child_frame_id of the odometry.")));
  list->push_back(
      basic(boolean_parameter("frames/publish_tf", &frames->publish_tf,
                              "Publish the transform map -> odom; false: another node does.")));
  list->push_back(real_parameter("frames/transform_tolerance", &frames->transform_tolerance, 0.0,
                                 100.0, "s", "How far the transform map -> odom is post-dated."));
}

}  // namespace

void apply_values(const Configuration& configuration, const PresetList& presets,
                  const ParameterList& defaults, const ParameterList& parameters,
                  PipelineOptions* options) {
  set_parameters(parameters, configuration.values);
  for (const auto& [name, value] : configuration.values) options->given.insert(name);
  if (configuration.values.count("preset") == 0) return;
  apply_preset(preset_named(presets, options->preset), presets, defaults, options->given,
               parameters);
}

Parameter directory_parameter(PipelineOptions* options) {
  return name_parameter(
      "map_file/directory", &options->directory,
      "Live: the folder of files that services name without a path; created if missing.");
}

void add_input_parameters(PipelineOptions* options, ParameterList* list) {
  for (Parameter& parameter : parameters_of(&options->odometry_input)) {
    list->push_back(std::move(parameter));
  }
  list->push_back(
      basic(integer_parameter("seed", &options->seed, 0, 2147483647,
                              "Seed of all random numbers; the same seed gives the same result.")));
  add_frame_parameters(&options->frames, list);
}

void add_output_parameters(PipelineOptions* options, ParameterList* list) {
  add_parameters(&options->checkpoint, list);
  add_parameters(&options->output, list);
}

}  // namespace pf_resampling
