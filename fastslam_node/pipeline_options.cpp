#include "fastslam_node/pipeline_options.hpp"

#include "src/configuration/text_parameter.hpp"
#include "src/frames/frame_pattern.hpp"

namespace pf_resampling {

ParameterList parameters_of(FastSlamPipelineOptions* options) {
  ParameterList list = parameters_of(&options->filter);
  for (Parameter& parameter : parameters_of(&options->odometry_input)) {
    list.push_back(std::move(parameter));
  }
  list.push_back(integer_parameter("seed", &options->seed, 0, 2147483647,
                                   "Of all random numbers: same seed, same result."));
  add_parameters(&options->frames, &list);
  list.push_back(integer_parameter("landmark_input/queue_length", &options->queue_length, 1,
                                   1000000, "Scans that may wait for odometry."));
  list.push_back(real_above_parameter("landmark_input/max_ahead", &options->max_ahead, 0.0, 1e6,
                                      "s", "A scan newer than the odometry by more is rejected."));
  list.push_back(real_above_parameter(
      "landmark_input/max_latency", &options->max_latency, 0.0, 1e6, "s",
      "Live: when computation does not keep up, what has waited longer is dropped."));
  list.push_back(pattern_parameter(
      "landmark_input/tag_pattern", &options->tag_pattern,
      "Takes the tf frames of detected tags as landmarks: regular expression that finds the id in "
      "the frame's name, as tag_(\\d+); empty: none are taken."));
  list.push_back(boolean_parameter("restart_after_jump_back", &options->restart_after_jump_back,
                                   "When time jumps back to about where it began (a bag played "
                                   "again) start anew, instead of with the last belief and map."));
  list.push_back(
      boolean_parameter("recovery/enabled", &options->recovers,
                        "Put the robot where most of the landmarks with ids that it sees "
                        "fit the map, once they do not fit its belief."));
  list.push_back(
      text_parameter("map_file/load", &options->map_file, "Map file to start with; empty: none."));
  list.push_back(integer_parameter("map_file/particles", &options->map_file_particles, 0, 1000000,
                                   "Particles whose own maps a saved map holds at most; with all "
                                   "of them, going on from it is as if nothing had happened."));
  add_parameters(&options->checkpoint, &list);
  add_parameters(&options->output, &list);
  list.push_back(real_parameter("output/map_period", &options->map_period, 0.0, 1e6, "s",
                                "Between landmark maps."));
  list.push_back(real_parameter("output/map_min_held", &options->map_min_held, 0.0, 1.0, "",
                                "Share of the weight that has to hold a landmark given out."));
  list.push_back(real_parameter("output/label_height", &options->label_height, 0.0, 1000.0, "m",
                                "Of the landmarks' ids; 0: chosen from the size of the map."));
  return list;
}

ParameterList live_parameters_of(FastSlamPipelineOptions* options) {
  return parameters_of(&options->filter);
}

void apply(const Configuration& configuration, FastSlamPipelineOptions* options) {
  apply_values(configuration, parameters_of(options));
  for (const auto& [frame, place] : configuration.sensors) options->sensors[frame] = place;
}

}  // namespace pf_resampling
