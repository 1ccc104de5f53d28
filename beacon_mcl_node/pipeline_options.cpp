#include "beacon_mcl_node/pipeline_options.hpp"

#include <algorithm>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

// A word; any but the empty one.
Parameter text_parameter(const std::string& name, std::string* field, const std::string& help) {
  Parameter parameter = make_choice_parameter(
      name, {}, help, [field] { return *field; }, nullptr);
  parameter.set_checked = [name, field](const std::string& text) {
    if (text.empty()) throw Error("parameter " + name + " is empty, has to be a name");
    *field = text;
  };
  return parameter;
}

}  // namespace

ParameterList parameters_of(BeaconMclPipelineOptions* options) {
  ParameterList list = parameters_of(&options->filter);
  for (Parameter& parameter : parameters_of(&options->odometry_input)) {
    list.push_back(std::move(parameter));
  }
  const auto period = [&](const char* name, double* field, const char* help) {
    list.push_back(real_parameter(name, field, 0.0, 1e6, "s", help));
  };
  list.push_back(integer_parameter("seed", &options->seed, 0, 2147483647,
                                   "Of all random numbers: same seed, same result."));
  list.push_back(text_parameter("frames/map", &options->map_frame, "Frame of beacons and poses."));
  list.push_back(text_parameter("frames/odom", &options->odom_frame,
                                "Frame that the odometry messages have to name."));
  list.push_back(text_parameter("frames/base", &options->base_frame,
                                "Frame of the robot that the odometry messages have to name."));
  list.push_back(real_parameter("frames/transform_tolerance", &options->transform_tolerance, 0.0,
                                100.0, "s", "By so much map -> odom is dated into the future."));
  list.push_back(integer_parameter("range_input/queue_length", &options->queue_length, 1, 1000000,
                                   "Ranges that may wait for odometry or for the beacons."));
  list.push_back(real_above_parameter("range_input/max_ahead", &options->max_ahead, 0.0, 1e6, "s",
                                      "A range newer than the odometry by more is rejected."));
  list.push_back(real_parameter("range_input/simultaneous", &options->simultaneous, 0.0, 1.0, "s",
                                "Ranges closer than this are taken together."));
  list.push_back(boolean_parameter("restart_after_jump_back", &options->restart_after_jump_back,
                                   "When time jumps back (a bag played again) start anew, instead "
                                   "of with the last belief."));
  period("output/cloud_period", &options->cloud_period,
         "Between particle clouds; 0: with every odometry message.");
  period("output/marker_period", &options->marker_period, "Between markers.");
  period("output/ring_lifetime", &options->ring_lifetime, "How long a range ring is shown.");
  period("output/path_period", &options->path_period, "Between paths.");
  list.push_back(real_parameter("output/path_spacing", &options->path_spacing, 0.0, 1e6, "m",
                                "Between poses of the path."));
  list.push_back(real_above_parameter("output/path_max_sigma", &options->path_max_sigma, 0.0, 1e9,
                                      "m", "Less certain positions are not put on the path."));
  list.push_back(integer_parameter("output/path_length", &options->path_length, 10, 10000000,
                                   "Poses; every second is left out when the path gets longer."));
  period("output/diagnostics_period", &options->diagnostics_period, "Between diagnostics.");
  return list;
}

void apply(const Configuration& configuration, BeaconMclPipelineOptions* options) {
  const ParameterList parameters = parameters_of(options);
  std::map<std::string, std::string> values = configuration.values;
  for (const Parameter& parameter : parameters) {
    // To the parameter server, which reads YAML 1.1, the word off is the boolean false.
    const auto value = values.find(parameter.name);
    const auto& choices = parameter.choices;
    if (value != values.end() && value->second == "false" &&
        std::find(choices.begin(), choices.end(), "off") != choices.end()) {
      value->second = "off";
    }
  }
  set_parameters(parameters, values);
  if (!configuration.beacons.empty()) options->beacons = configuration.beacons;
  for (const auto& [beacon, calibration] : configuration.calibration) {
    options->calibration[beacon] = calibration;
  }
  for (const auto& [frame, place] : configuration.antennas) options->antennas[frame] = place;
}

}  // namespace pf_resampling
