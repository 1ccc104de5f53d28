#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "pf_resampling_core/filters/fastslam/memory/segment_graph.hpp"

namespace pf_resampling {

/// The newest segments of a drive, and a segment in front of them that says what all others say of
/// what these may have to do with: as a Gaussian, linearised at the graph's estimate. So the
/// newest associations can be tried at a small part of the cost.
struct LocalGraph {
  SegmentGraph graph;
  std::vector<int> landmarks;  ///< numbers in the drive's graph
};

/// From segment `from` (1 on) to the newest. Nothing if what came before is not determined.
std::optional<LocalGraph> local_graph(const SegmentGraph& graph, std::size_t from);

}  // namespace pf_resampling
