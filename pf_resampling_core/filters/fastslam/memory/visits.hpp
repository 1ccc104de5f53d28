#pragma once

#include <optional>
#include <vector>

#include "pf_resampling_core/filters/fastslam/memory/scans.hpp"
#include "pf_resampling_core/filters/fastslam/memory/segment_graph.hpp"

namespace pf_resampling {

/// The robot arrives where a sighting follows a while without one, in which only odometry says
/// where it is: what it sees may be taken for the wrong landmarks.

/// Visits to the end: from scan `decided` on, if that is new, and in a large map only if a landmark
/// has come into view since; and the newest arrivals.
std::vector<Visit> doubtful_visits(const Scans& scans, int decided, bool is_large);

/// Of the visits between two arrivals, number `turn` if they are counted round and round.
std::optional<Visit> visit_of_the_past(const Scans& scans, int turn);

/// The segment from which on what was seen since the last arrivals is decided anew, and what was in
/// view before it. `begins`: of the segments; `decided`, `now`: s since the start.
std::size_t first_in_question(const SegmentGraph& graph, const std::vector<double>& begins,
                              double decided, double now);

}  // namespace pf_resampling
