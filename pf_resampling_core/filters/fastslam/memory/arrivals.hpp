#pragma once

#include <vector>

#include "pf_resampling_core/filters/fastslam/memory/scans.hpp"
#include "pf_resampling_core/filters/fastslam/memory/segment_graph.hpp"

namespace pf_resampling {

/// The robot arrives where a sighting follows a while without one, in which only odometry says
/// where it is: what it sees may be taken for the wrong landmarks.

/// The poses of the scans in which it arrived lately, the newest first.
std::vector<int> newest_arrivals(const Scans& scans);

/// The segment from which on what was seen since these arrivals is decided anew, and what was in
/// view before them. `begins`: of the segments; `decided`, `now`: s since the start.
std::size_t first_in_question(const SegmentGraph& graph, const std::vector<double>& begins,
                              double decided, double now);

}  // namespace pf_resampling
