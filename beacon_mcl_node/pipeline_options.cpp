#include "beacon_mcl_node/pipeline_options.hpp"

#include "src/configuration/text_parameter.hpp"
#include "src/frames/frame_pattern.hpp"

namespace pf_resampling {
ParameterList parameters_of(BeaconMclPipelineOptions* options) {
  ParameterList list = parameters_of(&options->filter);
  for (Parameter& parameter : parameters_of(&options->odometry_input)) {
    list.push_back(std::move(parameter));
  }
  list.push_back(integer_parameter("seed", &options->seed, 0, 2147483647,
                                   "Of all random numbers: same seed, same result."));
  add_parameters(&options->frames, &list);
  list.push_back(integer_parameter("range_input/queue_length", &options->queue_length, 1, 1000000,
                                   "Ranges that may wait for odometry or for the beacons."));
  list.push_back(real_above_parameter("range_input/max_ahead", &options->max_ahead, 0.0, 1e6, "s",
                                      "A range newer than the odometry by more is rejected."));
  list.push_back(real_parameter("range_input/simultaneous", &options->simultaneous, 0.0, 1.0, "s",
                                "Ranges closer than this are taken together."));
  list.push_back(real_above_parameter(
      "range_input/max_latency", &options->max_latency, 0.0, 1e6, "s",
      "Live: when computation does not keep up, what has waited longer is dropped."));
  list.push_back(pattern_parameter(
      "range_input/frame_pattern", &options->frame_pattern,
      "sensor_ranges: regular expression that finds the beacon's id in frame_id."));
  list.push_back(text_parameter("range_input/antenna", &options->antenna,
                                "sensor_ranges: frame of the antenna on the robot, which they "
                                "do not name; empty: frames/base."));
  list.push_back(boolean_parameter("restart_after_jump_back", &options->restart_after_jump_back,
                                   "When time jumps back to about where it began (a bag played "
                                   "again) start anew, instead of with the last belief."));
  add_parameters(&options->checkpoint, &list);
  add_parameters(&options->output, &list);
  list.push_back(real_parameter("output/ring_lifetime", &options->ring_lifetime, 0.0, 1e6, "s",
                                "How long a range ring is shown."));
  return list;
}

ParameterList live_parameters_of(BeaconMclPipelineOptions* options) {
  return parameters_of(&options->filter);
}

void apply(const Configuration& configuration, BeaconMclPipelineOptions* options) {
  apply_values(configuration, parameters_of(options));
  if (!configuration.beacons.empty()) {
    options->beacons = configuration.beacons;
    options->beacon_frames = configuration.beacon_frames;
  }
  for (const auto& [beacon, calibration] : configuration.calibration) {
    options->calibration[beacon] = calibration;
  }
  for (const auto& [frame, place] : configuration.antennas) options->antennas[frame] = place;
}

}  // namespace pf_resampling
