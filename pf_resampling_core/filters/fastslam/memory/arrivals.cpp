#include "pf_resampling_core/filters/fastslam/memory/arrivals.hpp"

#include <algorithm>
#include <limits>

#include "pf_resampling_core/filters/fastslam/memory/reassociation.hpp"

namespace pf_resampling {
namespace {

constexpr double kBlindness = 5.0;         // s without a sighting
constexpr double kLatestDecisions = 60.0;  // s after an arrival
constexpr std::size_t kMostArrivals = 2;

}  // namespace

std::vector<int> newest_arrivals(const Scans& scans) {
  std::vector<int> arrivals;
  double last = std::numeric_limits<double>::infinity();
  for (const SightingFactor& sighting : scans.sightings) {
    if (sighting.landmark < 0) continue;
    const double time = scans.times[static_cast<std::size_t>(sighting.pose)];
    const bool is_late = scans.times.back() - last <= kLatestDecisions;
    if (time - last > kBlindness && is_late) arrivals.push_back(sighting.pose);
    last = time;
  }
  std::reverse(arrivals.begin(), arrivals.end());
  arrivals.resize(std::min(arrivals.size(), kMostArrivals));
  return arrivals;
}

std::size_t first_in_question(const SegmentGraph& graph, const std::vector<double>& begins,
                              double decided, double now) {
  std::vector<double> arrivals;
  double last = -std::numeric_limits<double>::infinity();
  for_each_sighting(graph, begins, [&](int, double time, const SightingFactor&, int) {
    if (time - last > kBlindness && last > now - kLatestDecisions) arrivals.push_back(last);
    last = time;
  });
  double since = decided;
  if (!arrivals.empty()) {
    since = std::min(since, arrivals[arrivals.size() - std::min(arrivals.size(), kMostArrivals)]);
  }
  const auto behind = std::upper_bound(begins.begin(), begins.end(), since - kPassageGap);
  return behind == begins.begin() ? 0 : static_cast<std::size_t>(behind - begins.begin()) - 1;
}

}  // namespace pf_resampling
