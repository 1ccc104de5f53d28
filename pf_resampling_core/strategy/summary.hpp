#pragma once

#include <string>

#include "pf_resampling_core/strategy/excitation.hpp"
#include "pf_resampling_core/strategy/population_control.hpp"

namespace pf_resampling {

/// The strategy in one line: schedule, renewal, scheme and excitation.
std::string strategy_of(const PopulationControlOptions& population,
                        const ExcitationOptions& excitation);

}  // namespace pf_resampling
