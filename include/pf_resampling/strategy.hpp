#pragma once

#include <string>

#include "pf_resampling_core/excitation/excitation.hpp"
#include "pf_resampling_core/population_control.hpp"

namespace pf_resampling {

/// The strategy in one line: schedule, renewal, scheme and excitation.
std::string strategy_of(const PopulationControlOptions& population,
                        const ExcitationOptions& excitation);

}  // namespace pf_resampling
