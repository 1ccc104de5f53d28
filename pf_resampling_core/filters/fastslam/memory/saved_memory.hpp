#pragma once

#include "pf_resampling_core/files/archive.hpp"
#include "pf_resampling_core/filters/fastslam/memory/memory.hpp"

namespace pf_resampling {

/// A memory as it is saved: the data of its segments, and where these were condensed. What they are
/// condensed to is computed anew, to the same bits.
void describe(Archive& archive, MemoryState& memory);
void describe(Archive& archive, SegmentGraph& graph);
void describe(Archive& archive, Segment& segment);

}  // namespace pf_resampling
