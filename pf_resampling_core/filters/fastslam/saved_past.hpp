#pragma once

#include <string>

#include "pf_resampling_core/files/archive.hpp"
#include "pf_resampling_core/filters/fastslam/smoothed_past.hpp"

namespace pf_resampling {

/// What a redraw draws from, as it is saved.
void describe(Archive& archive, SmoothedPastState& past);

/// What is wrong with it, in words; nothing if all is well.
std::string fault_of(const SmoothedPastState& past);

}  // namespace pf_resampling
