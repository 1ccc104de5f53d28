#include "fastslam_node/pipeline_options.hpp"

#include "src/frames/frame_pattern.hpp"

namespace pf_resampling {

FastSlamPipelineOptions::FastSlamPipelineOptions(const std::string& preset_name)
    : filter(fastslam_options_of(preset_name)) {
  name = "fastslam";
  preset = preset_name;
}

ParameterList parameters_of(FastSlamPipelineOptions* options) {
  ParameterList list = {preset_parameter(fastslam_presets(), &options->preset)};
  for (Parameter& parameter : parameters_of(&options->filter)) list.push_back(std::move(parameter));
  add_input_parameters(kScanNames, options, &list);
  list.push_back(integer_parameter("landmark_input/max_observations", &options->max_observations, 1,
                                   1000000, "A scan with more observations is rejected."));
  list.push_back(pattern_parameter(
      "landmark_input/tag_pattern", &options->tag_pattern,
      "Takes detected tags, as tf frames, for landmarks: regular expression that finds the id in "
      "the frame's name, such as tag_(\\d+); empty: no tags."));
  list.push_back(
      text_parameter("map_file/load", &options->map_file,
                     "Map file, or list of surveyed landmarks, to load at the start; empty: "
                     "none."));
  list.push_back(boolean_parameter("map_file/global_localization", &options->starts_anywhere,
                                   "Look for the robot everywhere in the map that is loaded at the "
                                   "start, by what it sees; false: "
                                   "it is where the map was saved, or where initialpose says."));
  list.push_back(directory_parameter(options));
  list.push_back(integer_parameter("map_file/particles", &options->map_file_particles, 0, 1000000,
                                   "Number of particles at most whose own maps are saved with a "
                                   "map; with all of them, loading it continues exactly."));
  add_output_parameters(options, &list);
  list.push_back(real_parameter("output/map_period", &options->map_period, 0.0, 1e6, "s",
                                "Time between landmark maps."));
  list.push_back(real_parameter(
      "output/map_min_held", &options->map_min_held, 0.0, 1.0, "",
      "A landmark is in the map if particles with at least this share of the weight have it."));
  list.push_back(
      real_parameter("output/label_height", &options->label_height, 0.0, 1000.0, "m",
                     "Height of the landmarks' ids in rviz; 0: chosen from the size of the map."));
  return list;
}

void apply(const Configuration& configuration, FastSlamPipelineOptions* options) {
  FastSlamOptions defaults;
  apply_values(configuration, fastslam_presets(), parameters_of(&defaults), parameters_of(options),
               options);
  for (const auto& [frame, place] : configuration.sensors) options->sensors[frame] = place;
}

}  // namespace pf_resampling
