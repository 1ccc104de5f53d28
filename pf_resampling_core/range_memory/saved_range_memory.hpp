#pragma once

#include "pf_resampling_core/files/archive.hpp"
#include "pf_resampling_core/range_memory/range_memory.hpp"

namespace pf_resampling {

/// A memory as it is saved: all data and what was last made of them, without what it was told of
/// beacons, calibration and options: see RangeMemory::resume().
void describe(Archive& archive, RangeMemory& memory);
void describe(Archive& archive, RangeMemory::Radio& radio);
void describe(Archive& archive, RangeMode& mode);
void describe(Archive& archive, RangePrior& prior);
void describe(Archive& archive, RangeEstimate& estimate);
void describe(Archive& archive, RangeBelief& belief);
void describe(Archive& archive, RangePast& past);
void describe(Archive& archive, RadioPlace& place);
void describe(Archive& archive, RadioAccount& account);
void describe(Archive& archive, RangeNoise& noise);
void describe(Archive& archive, HeldRange& range);
void describe(Archive& archive, OdometryIncrement& motion);

}  // namespace pf_resampling
