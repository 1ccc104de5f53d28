#include "pf_resampling_core/filters/fastslam/memory/visits.hpp"

#include <algorithm>
#include <limits>

#include "pf_resampling_core/filters/fastslam/memory/reassociation.hpp"

namespace pf_resampling {
namespace {

constexpr double kBlindness = 5.0;         // s without a sighting
constexpr double kLatestDecisions = 60.0;  // s after an arrival
constexpr std::size_t kMostArrivals = 2;

// Whether a landmark has come into view since.
bool has_arrivals(const Scans& scans, int since) {
  std::vector<double> last;
  for (const SightingFactor& sighting : scans.sightings) {
    if (sighting.landmark < 0) continue;
    const std::size_t landmark = static_cast<std::size_t>(sighting.landmark);
    if (landmark >= last.size()) last.resize(landmark + 1, -kPassageGap);
    const double now = scans.times[static_cast<std::size_t>(sighting.pose)];
    if (sighting.pose >= since && now - last[landmark] > kPassageGap) return true;
    last[landmark] = now;
  }
  return false;
}

}  // namespace

std::vector<Visit> doubtful_visits(const Scans& scans, int decided, bool is_large) {
  const int end = static_cast<int>(scans.poses.size());
  std::vector<Visit> found, arrivals;
  const bool is_new = decided > 0 && decided < end;
  if (is_new && (!is_large || has_arrivals(scans, decided))) found.push_back({decided, end});
  double last = std::numeric_limits<double>::infinity();
  for (const SightingFactor& sighting : scans.sightings) {
    if (sighting.landmark < 0) continue;
    const double time = scans.times[static_cast<std::size_t>(sighting.pose)];
    const bool is_late = scans.times.back() - last <= kLatestDecisions;
    if (time - last > kBlindness && is_late) arrivals.push_back({sighting.pose, end});
    last = time;
  }
  const std::size_t newest = std::min(kMostArrivals, arrivals.size());
  found.insert(found.end(), arrivals.rbegin(),
               arrivals.rbegin() + static_cast<std::ptrdiff_t>(newest));
  return found;
}

std::optional<Visit> visit_of_the_past(const Scans& scans, int turn) {
  std::vector<Visit> visits;
  double last = -std::numeric_limits<double>::infinity();
  for (const SightingFactor& sighting : scans.sightings) {
    if (sighting.landmark < 0) continue;
    const double time = scans.times[static_cast<std::size_t>(sighting.pose)];
    if (time - last > kBlindness) visits.push_back({sighting.pose, sighting.pose});
    visits.back().last = sighting.pose + 1;
    last = time;
  }
  if (visits.size() < 2) return std::nullopt;
  return visits[static_cast<std::size_t>(turn) % (visits.size() - 1)];
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
