#pragma once

#include <cstddef>
#include <vector>

#include "pf_resampling_core/filters/fastslam/memory/segment_graph.hpp"
#include "pf_resampling_core/smoothing/cross_validation.hpp"

namespace pf_resampling {

/// A sighting by its segment and its place in that.
struct SightingPlace {
  std::size_t segment = 0;
  std::size_t sighting = 0;
};

/// Sightings that are left out, and groups of them, of one landmark each, whose means are predicted
/// from the rest. Errors that last stay hidden in the residuals of what was used, and show in those
/// of what was not. A passage is all that was seen of a landmark until it was out of view for 10 s,
/// or of 30 s; a window all that was seen in 25 s, with groups in the middle half.
struct LeftOutSightings {
  std::vector<SightingPlace> sightings;
  std::vector<std::vector<SightingPlace>> groups;
};

/// Passages that ended after `since` and no later than `until` (s). `begins`: of the segments.
std::vector<LeftOutSightings> completed_passages(const SegmentGraph& graph,
                                                 const std::vector<double>& begins, double since,
                                                 double until);

/// Windows, one every 12.5 s, that were complete, with 12.5 s of data behind them, after `since`
/// and no later than `until`.
std::vector<LeftOutSightings> completed_windows(const SegmentGraph& graph,
                                                const std::vector<double>& begins, double since,
                                                double until);

/// Leaves each block out in turn and predicts its groups, at the graph's estimate, which should be
/// a solution. Segments that saw something of it are condensed without it. Groups and blocks that
/// the rest of the data say nothing of are missing from the result.
std::vector<PredictedBlock> predict(const SegmentGraph& graph, double robust_width,
                                    const std::vector<LeftOutSightings>& blocks);

/// By what factors of what is stated, at most 1, the residuals of a landmark scatter from one scan
/// to the next, within a second: noise of the sightings that does not last, and what the odometry
/// adds. From medians; 1 where there are fewer than 100 such pairs.
NoiseScales scatter(const SegmentGraph& graph);

}  // namespace pf_resampling
