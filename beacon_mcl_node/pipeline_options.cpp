#include "beacon_mcl_node/pipeline_options.hpp"

#include "src/frames/frame_pattern.hpp"

namespace pf_resampling {

ParameterList parameters_of(BeaconMclPipelineOptions* options) {
  ParameterList list = {preset_parameter(beacon_mcl_presets(), &options->preset)};
  for (Parameter& parameter : parameters_of(&options->filter)) list.push_back(std::move(parameter));
  list.push_back(basic(choice_parameter("beacon_positions", &options->filter.beacon_positions,
                                        "Where beacons are: known, all as listed, or estimated, "
                                        "those that are not listed as well.")));
  add_input_parameters(options, &list);
  list.push_back(pattern_parameter(
      "range_input/frame_pattern", &options->frame_pattern,
      "sensor_ranges: regular expression whose group is the id of the beacon in frame_id."));
  list.push_back(text_parameter("range_input/antenna", &options->antenna,
                                "sensor_ranges: frame of the antenna on the robot, which these "
                                "messages lack; empty: frames/base."));
  list.push_back(directory_parameter(options));
  add_output_parameters(options, &list);
  return basic_first(list);
}

void apply(const Configuration& configuration, BeaconMclPipelineOptions* options) {
  BeaconMclOptions defaults;
  apply_values(configuration, beacon_mcl_presets(), parameters_of(&defaults),
               parameters_of(options), options);
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
