#include "pf_resampling_core/strategy/summary.hpp"

#include <cstdio>

namespace pf_resampling {

std::string strategy_of(const PopulationControlOptions& population,
                        const ExcitationOptions& excitation) {
  std::string strategy = to_string(population.schedule);
  char text[60];
  if (population.schedule == Schedule::effective_sample_size) {
    std::snprintf(text, sizeof(text), " < %g", population.threshold);
    strategy += text;
  } else if (population.schedule == Schedule::every_n) {
    strategy += " " + std::to_string(population.every_n);
  }
  strategy += ", " + to_string(population.renewal);
  if (population.renewal == Renewal::resampling) {
    strategy += " " + to_string(population.resampling.scheme);
  } else if (population.renewal == Renewal::compensation) {
    std::snprintf(text, sizeof(text), " %s %g %%",
                  to_string(population.compensation.pairing).c_str(),
                  100.0 * population.compensation.ratio);
    strategy += text;
  }
  return strategy + ", " + to_string(excitation.excitation);
}

}  // namespace pf_resampling
