#pragma once

#include <string>

#include "pf_resampling_core/files/archive.hpp"
#include "pf_resampling_core/range_memory/range_memory.hpp"

namespace pf_resampling {

inline constexpr FileKind kBeaconFile = {"file of beacons",
                                         "beacons",
                                         "pf_resampling beacons 1",
                                         true,
                                         "give one that save_beacons or survey_beacons wrote",
                                         "write it again"};

/// What a memory of ranges has found, as a configuration: the list `beacons`, with a standard
/// deviation of each that was found, and the list `calibration`. A beacon that may be at several
/// places, or is hardly known, is a comment. `source`: where the ranges are from.
std::string beacon_file(const std::string& source, const RangeMemory& memory);

}  // namespace pf_resampling
