#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "pf_resampling_core/filters/fastslam/memory/segment_graph.hpp"

namespace pf_resampling {

/// The newest part of a drive, scan by scan, at the graph's estimate: what data association looks
/// at and changes.
struct Scans {
  std::size_t first_segment = 0;      ///< of the graph; to the newest
  int first_update = 0;               ///< number of the first pose among all updates
  std::vector<std::size_t> ends;      ///< behind the last pose of each segment
  std::vector<Pose2> poses;           ///< map frame, one for each update
  std::vector<double> times;          ///< s since the start
  std::vector<MotionFactor> motions;  ///< i leads to poses[i]
  /// `pose` of these poses, ascending; `landmark` of the graph, -1: of none.
  std::vector<SightingFactor> sightings;
  std::vector<int> before;  ///< their landmarks in the graph
};

/// The first of the newest segments that have at least `updates` updates, as far as the graph has
/// data of them.
std::size_t first_of_newest(const SegmentGraph& graph, int updates);

/// Of these segments. `begins`: of the segments, s.
Scans newest_scans(const SegmentGraph& graph, const std::vector<double>& begins, int updates);

/// Takes over the poses and the landmarks of the sightings. Segments in which something has changed
/// are condensed anew. False, with the graph half done, if one cannot be.
bool put_back(const Scans& scans, double robust_width, SegmentGraph* graph);

/// s, of a segment's updates.
std::vector<double> times_of(const Segment& segment, double begin);

/// Calls `visit(update, time, sighting, landmark)` for each sighting of a landmark that the graph
/// has data of, in order.
void for_each_sighting(const SegmentGraph& graph, const std::vector<double>& begins,
                       const std::function<void(int, double, const SightingFactor&, int)>& visit);

/// Of each landmark, whether a segment has seen it, `from` one on, or a belief at the start.
std::vector<bool> seen_landmarks(const SegmentGraph& graph, std::size_t from = 0);

/// Which of some landmarks a scan has seen beside each other: a row and a column for each.
using Together = Eigen::Matrix<bool, Eigen::Dynamic, Eigen::Dynamic>;
Together seen_together(const SegmentGraph& graph, const std::vector<int>& landmarks);

/// Passages of landmarks through the view: how many there were, on how many of them the landmark
/// was not seen, and on how many only in less than half of the scans. A sensor that misses
/// landmarks has many of these; where the robot is not where it believes, landmarks are missed
/// altogether.
struct ViewPassages {
  int all = 0;
  int missed = 0;
  int hardly_seen = 0;
};
/// Of the landmarks at some places (map frame) in these scans, one after the other; before they
/// were first seen, too. In view is what all these sightings together say: see SensorView.
ViewPassages view_passages(const std::vector<Eigen::Vector2d>& places,
                           const std::vector<const Scans*>& parts);

/// Gives tracks of landmark l to new_number[l]; where that is -1, their sightings are of none. New
/// numbers may be the same: the landmarks are one. The graph's landmarks keep their numbers.
bool renumber(const std::vector<int>& new_number, double robust_width, SegmentGraph* graph);

}  // namespace pf_resampling
