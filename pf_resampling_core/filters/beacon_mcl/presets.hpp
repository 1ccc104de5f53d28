#pragma once

#include "pf_resampling_core/filters/beacon_mcl/options.hpp"
#include "pf_resampling_core/parameters/presets.hpp"

namespace pf_resampling {

/// What users choose between by one name, each a set of values in place of the defaults of
/// BeaconMclOptions; the first has none.
const PresetList& beacon_mcl_presets();

/// The defaults with the values of that preset. Throws Error that lists the names there are.
BeaconMclOptions beacon_mcl_options_of(const std::string& preset);

}  // namespace pf_resampling
