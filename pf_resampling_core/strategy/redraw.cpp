#include "pf_resampling_core/strategy/redraw.hpp"

#include <string>

namespace pf_resampling {

void add_parameters(RedrawOptions* options, ParameterList* parameters) {
  const std::string group = "population/redraw/";
  parameters->push_back(integer_parameter(
      group + "closure_absence", &options->closure_absence, 0, 1000000,
      "redraw: when a landmark is seen again after so many updates without it. 0: never."));
  parameters->push_back(integer_parameter(
      group + "closure_spacing", &options->closure_spacing, 0, 1000000,
      "redraw: for so many updates after the last one, landmarks that are seen again wait."));
  parameters->push_back(integer_parameter(
      group + "every_n", &options->every_n, 0, 1000000,
      "redraw: also after so many updates since the last one. 0: only at closures."));
  parameters->push_back(real_above_parameter(
      group + "tempering", &options->tempering, 0.0, 1.0, "",
      "redraw: share of what the observations say that the weights take up between redraws."));
  parameters->push_back(real_parameter(
      group + "robust_width", &options->robust_width, 0.0, 1e6, "",
      "redraw: standard deviations beyond which an observation begins to count for less. 0: "
      "never."));
  parameters->push_back(integer_parameter(
      group + "window", &options->window, 0, 1000000,
      "redraw, without ids: the newest so many updates are solved for; what older ones say is kept "
      "as it was linearised. 0: all. With ids, all are."));
  parameters->push_back(boolean_parameter(group + "learn_noise", &options->learn_noise,
                                          "redraw: find out by how much the noise of observations "
                                          "and odometry is larger than stated."));
  parameters->push_back(integer_parameter(
      group + "max_landmarks", &options->max_landmarks, 1, 10000,
      "redraw: a map with more landmarks is not redrawn, and resampling goes on alone. Each pair "
      "of landmarks takes a few times 32 bytes."));
}

}  // namespace pf_resampling
