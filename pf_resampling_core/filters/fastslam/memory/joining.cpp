#include "pf_resampling_core/filters/fastslam/memory/joining.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "pf_resampling_core/filters/fastslam/memory/scans.hpp"
#include "pf_resampling_core/filters/fastslam/memory/segment_equations.hpp"

namespace pf_resampling {
namespace {

constexpr double kApart = 60.0;  // s, between sightings that tell of a slip
constexpr int kAnchors = 2;

// The poses, tracks and constants of one segment that is to stand for `count`, from their base.
Segment frame_of(const SegmentGraph& graph, std::size_t first, std::size_t count) {
  const Pose2& base = graph.bases[first];
  Segment all;
  for (std::size_t s = first; s < first + count; ++s) {
    const Pose2 from = relative(base, graph.bases[s]);
    for (const Pose2& pose : poses_of(graph, s)) all.poses.push_back(compose(from, pose));
    for (const int landmark : graph.segments[s]->landmarks) {
      if (std::find(all.landmarks.begin(), all.landmarks.end(), landmark) != all.landmarks.end()) {
        continue;
      }
      all.landmarks.push_back(landmark);
      all.tracks.push_back(seen_from(base, graph.landmarks[static_cast<std::size_t>(landmark)]));
    }
  }
  all.constants = graph.constants;
  all.noise = graph.noise;
  return all;
}

int track_of(const Segment& segment, int landmark) {
  const auto found = std::find(segment.landmarks.begin(), segment.landmarks.end(), landmark);
  return static_cast<int>(found - segment.landmarks.begin());
}

void replace(std::size_t first, std::size_t count, Segment segment, SegmentGraph* graph) {
  const auto erase_behind_first = [&](auto* list) {
    const auto behind = list->begin() + static_cast<std::ptrdiff_t>(first) + 1;
    list->erase(behind, behind + static_cast<std::ptrdiff_t>(count) - 1);
  };
  erase_behind_first(&graph->segments);
  erase_behind_first(&graph->bases);
  erase_behind_first(&graph->motion_shares);
  graph->segments[first] = std::make_shared<const Segment>(std::move(segment));
  graph->motion_shares[first] = 1.0;
}

}  // namespace

bool join_segments(std::size_t first, std::size_t count, double robust_width, SegmentGraph* graph) {
  Segment all = frame_of(*graph, first, count);
  for (std::size_t s = first; s < first + count; ++s) {
    const Segment& part = *graph->segments[s];
    const int before = static_cast<int>(all.motions.size());
    all.motions.insert(all.motions.end(), part.motions.begin(), part.motions.end());
    for (SightingFactor sighting : part.sightings) {
      sighting.pose += before;
      sighting.landmark =
          track_of(all, part.landmarks[static_cast<std::size_t>(sighting.landmark)]);
      all.sightings.push_back(sighting);
    }
    for (SightingFactor sighting : part.unassigned) {
      sighting.pose += before;
      all.unassigned.push_back(sighting);
    }
  }
  if (!fit(FreePart::between, robust_width, &all) || !condense(robust_width, &all)) return false;
  replace(first, count, std::move(all), graph);
  return true;
}

bool join_without_data(std::size_t first, SegmentGraph* graph) {
  constexpr std::size_t kCount = 2;
  Segment all = frame_of(*graph, first, kCount);
  SegmentGraph part;
  std::vector<int> last;  // landmarks have the numbers of their tracks
  for (const Eigen::Vector2d& track : all.tracks) {
    last.push_back(static_cast<int>(part.landmarks.size()));
    part.landmarks.push_back(track);
  }
  part.bases = {Pose2{}};
  part.constants = graph->constants;
  part.constants_sigma.setOnes();  // taken out again: of some these data say nothing
  part.noise = graph->noise;
  std::vector<int> tracks(graph->landmarks.size(), -1);
  for (std::size_t k = 0; k < all.landmarks.size(); ++k) {
    tracks[static_cast<std::size_t>(all.landmarks[k])] = static_cast<int>(k);
  }
  for (std::size_t s = first; s < first + kCount; ++s) {
    Segment segment = *graph->segments[s];
    for (int& landmark : segment.landmarks) landmark = tracks[static_cast<std::size_t>(landmark)];
    part.segments.push_back(std::make_shared<const Segment>(std::move(segment)));
    part.bases.push_back(relative(graph->bases[first], graph->bases[s + 1]));
    part.motion_shares.push_back(graph->motion_shares[s]);
  }
  SegmentEquations equations(part, &last);
  equations.linearize(part);
  if (!equations.factorize(0.0)) return false;
  auto [gradient, information] = equations.condensed_to_last();
  gradient.tail<kSensorConstants>() -= part.constants;
  information.diagonal().tail<kSensorConstants>().array() -= 1.0;
  if (!gradient.allFinite() || !information.allFinite()) return false;
  all.condensed = condensed_belief(information, gradient);
  const Together together = seen_together(part, last);
  for (int a = 0; a < together.rows(); ++a) {
    for (int b = 0; b < a; ++b) {
      if (together(a, b)) all.beside.push_back({a, b});
    }
  }
  replace(first, kCount, std::move(all), graph);
  return true;
}

std::vector<bool> anchored_segments(const SegmentGraph& graph, const std::vector<double>& begins) {
  const std::size_t count = graph.segments.size();
  std::vector<double> earliest(graph.landmarks.size(), std::numeric_limits<double>::infinity());
  std::vector<double> latest(graph.landmarks.size(), -std::numeric_limits<double>::infinity());
  for (std::size_t s = 0; s < count; ++s) {
    for (const int landmark : graph.segments[s]->landmarks) {
      const std::size_t l = static_cast<std::size_t>(landmark);
      earliest[l] = std::min(earliest[l], begins[s]);
      latest[l] = std::max(latest[l], begins[s]);
    }
  }
  std::vector<bool> has_anchors;
  for (std::size_t s = 0; s < count; ++s) {
    const std::vector<int>& landmarks = graph.segments[s]->landmarks;
    const auto anchors = std::count_if(landmarks.begin(), landmarks.end(), [&](int landmark) {
      const std::size_t l = static_cast<std::size_t>(landmark);
      return begins[s] - earliest[l] > kApart || latest[l] - begins[s] > kApart;
    });
    has_anchors.push_back(anchors >= kAnchors);
  }
  std::vector<bool> anchored;
  for (std::size_t s = 0; s < count; ++s) {
    anchored.push_back(has_anchors[s] && (s == 0 || has_anchors[s - 1]) && s + 1 < count &&
                       has_anchors[s + 1]);
  }
  return anchored;
}

}  // namespace pf_resampling
