#include "fastslam_node/pipeline_options.hpp"

#include "src/frames/frame_pattern.hpp"

namespace pf_resampling {

FastSlamPipelineOptions::FastSlamPipelineOptions(const std::string& preset_name)
    : filter(fastslam_options_of(preset_name)) {
  name = "fastslam";
  preset = preset_name;
  odometry_input.use_twist_covariance = true;
}

ParameterList parameters_of(FastSlamPipelineOptions* options) {
  ParameterList list = {preset_parameter(fastslam_presets(), &options->preset)};
  for (Parameter& parameter : parameters_of(&options->filter)) list.push_back(std::move(parameter));
  add_input_parameters(options, &list);
  list.push_back(
      pattern_parameter("landmark_input/tag_pattern", &options->tag_pattern,
                        "Use tags on /tf as landmarks: regular expression whose group is the id in "
                        "the name of the frame, such as tag_(\\d+); empty: off."));
  list.push_back(basic(
      text_parameter("map_file/load", &options->map_file,
                     "Map file or list of surveyed landmarks to load at the start; empty: none.")));
  list.push_back(
      basic(boolean_parameter("map_file/global_localization", &options->starts_anywhere,
                              "Global localization in the map that is loaded at the start; false: "
                              "the robot is where the map was saved, or at initialpose.")));
  list.push_back(directory_parameter(options));
  add_output_parameters(options, &list);
  return basic_first(list);
}

void apply(const Configuration& configuration, FastSlamPipelineOptions* options) {
  FastSlamOptions defaults;
  apply_values(configuration, fastslam_presets(), parameters_of(&defaults), parameters_of(options),
               options);
  for (const auto& [frame, place] : configuration.sensors) options->sensors[frame] = place;
}

}  // namespace pf_resampling
