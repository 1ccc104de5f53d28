#include "pf_resampling_core/filters/fastslam/memory/local_account.hpp"

#include <algorithm>
#include <limits>
#include <memory>
#include <utility>

namespace pf_resampling {

Account part_of(const Account& account, const LocalGraph& local) {
  Account part;
  part.graph = local.graph;
  for (const int landmark : local.landmarks) {
    part.landmarks.push_back(account.landmarks[static_cast<std::size_t>(landmark)]);
  }
  return part;
}

bool put_back(const Account& part, const LocalGraph& local, std::size_t from, double robust_width,
              Account* account) {
  SegmentGraph& graph = account->graph;
  std::vector<int> landmarks = local.landmarks;
  while (landmarks.size() < part.landmarks.size()) {
    landmarks.push_back(static_cast<int>(graph.landmarks.size()));
    graph.landmarks.emplace_back(0.0, 0.0);
    account->landmarks.emplace_back();
  }
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const std::size_t l = static_cast<std::size_t>(landmarks[i]);
    graph.landmarks[l] = part.graph.landmarks[i];
    account->landmarks[l] = part.landmarks[i];
  }
  // What the segments before have seen may have become others.
  std::vector<int> number(graph.landmarks.size());
  for (std::size_t l = 0; l < number.size(); ++l) number[l] = static_cast<int>(l);
  const std::vector<int>& before = local.graph.segments.front()->landmarks;
  const std::vector<int>& after = part.graph.segments.front()->landmarks;
  const auto in_drive = [&](int landmark) { return landmarks[static_cast<std::size_t>(landmark)]; };
  for (std::size_t k = 0; k < before.size(); ++k) {
    number[static_cast<std::size_t>(in_drive(before[k]))] = in_drive(after[k]);
  }
  const std::size_t count = graph.segments.size();
  for (std::size_t s = from; s < count; ++s) {
    const std::size_t i = s - from + 1;
    Segment segment = *part.graph.segments[i];
    for (int& landmark : segment.landmarks) landmark = in_drive(landmark);
    graph.segments[s] = std::make_shared<const Segment>(std::move(segment));
    graph.motion_shares[s] = part.graph.motion_shares[i];
    graph.bases[s + 1] = part.graph.bases[i + 1];
  }
  graph.bases[from] = part.graph.bases[1];
  graph.constants = part.graph.constants;
  return renumber(number, robust_width, &graph);
}

Past past_of(const Account& account, const DriveTimes& times, std::size_t from,
             const LocalGraph& local) {
  const SegmentGraph& graph = account.graph;
  Past past;
  std::vector<bool> is_local(graph.landmarks.size(), false);
  for (const int landmark : local.landmarks) is_local[static_cast<std::size_t>(landmark)] = true;
  std::vector<int> number(graph.landmarks.size(), -1);
  for (std::size_t l = 0; l < number.size(); ++l) {
    if (is_local[l] || account.landmarks[l].id < 0) continue;
    number[l] = static_cast<int>(past.others.size());
    past.others.push_back(graph.landmarks[l]);
  }
  int next = static_cast<int>(past.others.size());
  for (const int landmark : local.landmarks) number[static_cast<std::size_t>(landmark)] = next++;
  past.scans = newest_scans(graph, times.begins, std::numeric_limits<int>::max());
  const std::size_t first = past.scans.first_segment;
  const int poses = from > first ? static_cast<int>(past.scans.ends[from - first - 1]) : 0;
  std::vector<SightingFactor>& sightings = past.scans.sightings;
  sightings.erase(
      std::find_if(sightings.begin(), sightings.end(),
                   [&](const SightingFactor& sighting) { return sighting.pose >= poses; }),
      sightings.end());
  for (SightingFactor& sighting : sightings) {
    if (sighting.landmark < 0) continue;
    sighting.landmark = number[static_cast<std::size_t>(sighting.landmark)];
  }
  return past;
}

}  // namespace pf_resampling
