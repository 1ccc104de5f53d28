#pragma once

#include <vector>

#include "pf_resampling_core/filters/fastslam/memory/segment_graph.hpp"

namespace pf_resampling {

/// Makes one segment of `count` neighbours from `first` on, all of which have data: their poses are
/// solved for together, and no accuracy is lost. False, changing nothing, if they do not determine
/// these.
bool join_segments(std::size_t first, std::size_t count, double robust_width, SegmentGraph* graph);

/// Makes one segment of `first` and the next, of which the data go: the base between them is
/// eliminated in the frame of the first. Odometry keeps the weight that it has. False, changing
/// nothing, if they do not determine that base.
bool join_without_data(std::size_t first, SegmentGraph* graph);

/// Of each segment, whether it and its neighbours have each seen two landmarks that were also seen
/// 60 s before or after: had wheels slipped there, it would have been found. `begins`: of the
/// segments, s.
std::vector<bool> anchored_segments(const SegmentGraph& graph, const std::vector<double>& begins);

}  // namespace pf_resampling
