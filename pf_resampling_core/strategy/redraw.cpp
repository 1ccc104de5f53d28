#include "pf_resampling_core/strategy/redraw.hpp"

#include <string>

namespace pf_resampling {

void add_parameters(RedrawOptions* options, ParameterList* parameters) {
  const std::string group = "population/redraw/";
  parameters->push_back(integer_parameter(group + "closure_absence", &options->closure_absence, 0,
                                          1000000,
                                          "redraw at loop closures: when a landmark is seen again "
                                          "after this many updates out of view. 0: never."));
  parameters->push_back(integer_parameter(
      group + "closure_spacing", &options->closure_spacing, 0, 1000000,
      "redraw: minimum number of updates from the last redraw to one at a loop closure."));
  parameters->push_back(integer_parameter(
      group + "every_n", &options->every_n, 0, 1000000,
      "redraw: also after this many updates since the last one. 0: only at loop closures."));
  parameters->push_back(
      real_above_parameter(group + "tempering", &options->tempering, 0.0, 1.0, "",
                           "redraw: exponent on the likelihood in the weights between redraws."));
  parameters->push_back(
      real_parameter(group + "robust_width", &options->robust_width, 0.0, 1e6, "",
                     "redraw: width of Cauchy's loss, in standard deviations; beyond it "
                     "observations are down-weighted. 0: least squares."));
  parameters->push_back(boolean_parameter(group + "learn_noise", &options->learn_noise,
                                          "redraw: learn by what factors the noise of observations "
                                          "and odometry exceeds what is stated."));
  parameters->push_back(
      integer_parameter(group + "max_landmarks", &options->max_landmarks, 1, 10000,
                        "redraw: maps with more landmarks are not redrawn, only resampled. Each "
                        "pair of landmarks takes a few times 32 bytes."));
}

}  // namespace pf_resampling
