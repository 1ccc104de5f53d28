#include "pf_resampling_core/filters/fastslam/recent_sightings.hpp"

#include <set>

namespace pf_resampling {
namespace {

// For so long odometry alone may lie between sightings.
constexpr std::int64_t kRecentWindow = 10'000'000'000;  // ns
constexpr std::size_t kLeastRecentScans = 3;            // one alone may be a mistake of the sensor
constexpr std::size_t kMostRecent = 60;

}  // namespace

void RecentSightings::add(std::int64_t stamp, const LandmarkSighting& sighting) {
  sightings_.push_back({stamp, sighting});
}

void RecentSightings::forget_before(std::int64_t stamp) {
  while (!sightings_.empty() &&
         (sightings_.size() > kMostRecent || stamp - sightings_.front().stamp > kRecentWindow)) {
    sightings_.pop_front();
  }
}

void RecentSightings::move(const Pose2& correction) {
  for (Stamped& stamped : sightings_) {
    stamped.sighting.seen = moved(stamped.sighting.seen, correction);
  }
}

bool RecentSightings::suffice() const {
  std::set<std::int64_t> scans;
  std::set<std::int64_t> landmarks;
  for (const Stamped& stamped : sightings_) {
    scans.insert(stamped.stamp);
    landmarks.insert(stamped.sighting.id);
  }
  return scans.size() >= kLeastRecentScans && landmarks.size() >= 2;
}

std::vector<LandmarkSighting> RecentSightings::all() const {
  std::vector<LandmarkSighting> all;
  for (const Stamped& stamped : sightings_) all.push_back(stamped.sighting);
  return all;
}

}  // namespace pf_resampling
