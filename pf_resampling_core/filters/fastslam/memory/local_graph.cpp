#include "pf_resampling_core/filters/fastslam/memory/local_graph.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "pf_resampling_core/filters/fastslam/memory/scans.hpp"
#include "pf_resampling_core/filters/fastslam/memory/segment_equations.hpp"

namespace pf_resampling {
namespace {

constexpr double kUnbounded = 1e9;  // standard deviation of constants that a segment knows
// Landmarks that were not seen, the nearest: they may be those that were.
constexpr std::size_t kMostOthers = 25;

SegmentGraph first_segments(const SegmentGraph& graph, std::size_t count) {
  SegmentGraph first = graph;
  first.segments.resize(count);
  first.bases.resize(count + 1);
  first.motion_shares.resize(count);
  return first;
}

}  // namespace

std::optional<LocalGraph> local_graph(const SegmentGraph& graph, std::size_t from) {
  const std::size_t count = graph.segments.size();
  const SegmentGraph before = first_segments(graph, from);
  const std::vector<bool> known = seen_landmarks(before);
  const std::vector<bool> seen = seen_landmarks(graph, from);
  LocalGraph local;
  std::vector<std::pair<double, int>> others;  // by the squared distance to what was seen
  for (std::size_t l = 0; l < graph.landmarks.size(); ++l) {
    if (seen[l]) local.landmarks.push_back(static_cast<int>(l));
    if (seen[l] || !known[l]) continue;
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t other = 0; other < seen.size(); ++other) {
      if (!seen[other]) continue;
      nearest = std::min(nearest, (graph.landmarks[l] - graph.landmarks[other]).squaredNorm());
    }
    others.emplace_back(nearest, static_cast<int>(l));
  }
  std::sort(others.begin(), others.end());
  others.resize(std::min(others.size(), kMostOthers));
  for (const auto& [distance, landmark] : others) local.landmarks.push_back(landmark);
  std::sort(local.landmarks.begin(), local.landmarks.end());

  const Pose2& base = graph.bases[from];
  Segment given;
  given.poses = {base};
  given.constants = graph.constants;
  given.noise = graph.noise;
  std::vector<int> tracked;
  for (std::size_t i = 0; i < local.landmarks.size(); ++i) {
    const std::size_t l = static_cast<std::size_t>(local.landmarks[i]);
    if (!known[l]) continue;
    given.landmarks.push_back(static_cast<int>(i));
    given.tracks.push_back(graph.landmarks[l]);
    tracked.push_back(local.landmarks[i]);
  }
  SegmentEquations equations(before, &tracked);
  equations.linearize(before);
  if (!equations.factorize(0.0)) return std::nullopt;
  const auto [gradient, information] = equations.condensed_to_last();
  if (!information.allFinite() || !gradient.allFinite()) return std::nullopt;
  given.condensed = condensed_belief(information, gradient);

  const Together together = seen_together(before, tracked);
  for (int a = 0; a < together.rows(); ++a) {
    for (int b = 0; b < a; ++b) {
      if (together(a, b)) given.beside.push_back({a, b});
    }
  }

  SegmentGraph& part = local.graph;
  part.segments.push_back(std::make_shared<const Segment>(std::move(given)));
  part.motion_shares.push_back(1.0);
  part.bases = {Pose2{}, base};
  std::vector<int> number(graph.landmarks.size(), -1);
  for (std::size_t i = 0; i < local.landmarks.size(); ++i) {
    const std::size_t l = static_cast<std::size_t>(local.landmarks[i]);
    number[l] = static_cast<int>(i);
    part.landmarks.push_back(graph.landmarks[l]);
  }
  for (std::size_t s = from; s < count; ++s) {
    Segment segment = *graph.segments[s];
    for (int& landmark : segment.landmarks) landmark = number[static_cast<std::size_t>(landmark)];
    part.segments.push_back(std::make_shared<const Segment>(std::move(segment)));
    part.motion_shares.push_back(graph.motion_shares[s]);
    part.bases.push_back(graph.bases[s + 1]);
  }
  part.constants = graph.constants;
  part.constants_sigma.setConstant(kUnbounded);
  part.noise = graph.noise;
  return local;
}

}  // namespace pf_resampling
