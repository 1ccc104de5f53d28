#include "fastslam_node/recent_sightings.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace pf_resampling {
namespace {

// s; for so long odometry alone may lie between sightings.
constexpr double kWindow = 10.0;
constexpr std::size_t kLeastScans = 3;  // one alone may be a mistake of the sensor
constexpr std::size_t kMost = 60;

}  // namespace

void RecentSightings::add(ros::Time stamp, const Pose2& eye,
                          const std::vector<RangeBearingObservation>& observations,
                          const LandmarkSensorOptions& sensor, FastSlam* filter) {
  for (const RangeBearingObservation& z : observations) {
    const std::optional<LandmarkEstimate> landmark = filter->landmark(z.id);
    if (!landmark) continue;
    const double direction = eye.heading + z.bearing;
    LandmarkSighting sighting;
    sighting.id = z.id;
    sighting.seen = {eye.x + z.range * std::cos(direction), eye.y + z.range * std::sin(direction)};
    sighting.mapped = landmark->mean;
    sighting.sigma =
        std::sqrt(range_variance(sensor, z) + z.range * z.range * bearing_variance(sensor, z) +
                  landmark->covariance.trace());
    sightings_.push_back({stamp, sighting});
  }
  while (!sightings_.empty() &&
         (sightings_.size() > kMost || (stamp - sightings_.front().stamp).toSec() > kWindow)) {
    sightings_.pop_front();
  }
}

bool RecentSightings::suffice() const {
  std::set<ros::Time> scans;
  std::set<std::int64_t> landmarks;
  for (const Stamped& stamped : sightings_) {
    scans.insert(stamped.stamp);
    landmarks.insert(stamped.sighting.id);
  }
  return scans.size() >= kLeastScans && landmarks.size() >= 2;
}

std::vector<LandmarkSighting> RecentSightings::all() const {
  std::vector<LandmarkSighting> all;
  for (const Stamped& stamped : sightings_) all.push_back(stamped.sighting);
  return all;
}

bool fits(const std::vector<ObservationOutcome>& outcomes) {
  std::ptrdiff_t known = 0;
  std::ptrdiff_t believed = 0;
  for (const ObservationOutcome& outcome : outcomes) {
    if (outcome.is_new) continue;
    ++known;
    if (outcome.accepted >= 0.5) ++believed;
  }
  return 2 * believed > known;
}

}  // namespace pf_resampling
