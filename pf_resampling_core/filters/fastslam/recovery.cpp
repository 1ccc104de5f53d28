// How FastSlam finds a robot that was carried away: by the landmarks with ids that it sees.
#include <cmath>

#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "pf_resampling_core/health/lost_detector.hpp"

namespace pf_resampling {
namespace {

// Whether most of a scan's observations of landmarks that were known before were believed.
bool fits(const std::vector<ObservationOutcome>& outcomes) {
  std::ptrdiff_t known = 0;
  std::ptrdiff_t believed = 0;
  for (const ObservationOutcome& outcome : outcomes) {
    if (outcome.is_new) continue;
    ++known;
    if (outcome.is_believed()) ++believed;
  }
  return 2 * believed > known;
}

}  // namespace

std::optional<PoseEstimate> FastSlam::recover(
    const std::vector<RangeBearingObservation>& observations, const Pose2& sensor,
    std::int64_t stamp, double lost) {
  if (fits(outcomes_)) unplaced_since_ = -1.0;
  if (!options_.recovery.enabled || association_ != DataAssociation::known) return std::nullopt;
  // While a map is being made, it may be the map that is wrong: all of it is solved anew.
  const bool remembers = keeps_past() && !memory_.is_empty();
  is_lost_ = remembers && lost > kLikelyLost && !fits(outcomes_);
  if (fits(outcomes_)) {
    sightings_.clear();
    return std::nullopt;
  }
  const Pose2 robot = estimate().mean;
  const Pose2 eye = compose(robot, sensor);
  for (const RangeBearingObservation& z : observations) {
    const std::optional<LandmarkEstimate> mapped = landmark(z.id);
    if (!mapped) continue;
    const double sigma = std::sqrt(range_variance(options_.sensor, z) +
                                   z.range * z.range * bearing_variance(options_.sensor, z) +
                                   mapped->covariance.trace());
    sightings_.add({z.id, place_seen(eye, z.range, z.bearing), mapped->mean, sigma, stamp});
  }
  sightings_.forget_before(stamp);
  if (!(lost > kLikelyLost) || !sightings_.are_of_several_scans()) return std::nullopt;
  std::optional<PoseEstimate> found = relocalize(sightings_.all(), robot);
  if (!found) return std::nullopt;
  if (remembers) {
    // Has to explain the whole drive better.
    const bool was_carried =
        memory_.solve_carried(options_.strategy.redraw.robust_width, found->mean, unplaced_since_);
    sightings_.clear();
    if (!was_carried) return std::nullopt;
    unplaced_since_ = -1.0;
    ++step_;  // for a draw of its own
    if (!draw_from_memory(requested_size_)) return std::nullopt;
    status_.injected += particles_.size();
    return estimate();
  }
  set_poses(*found);
  unplaced_since_ = -1.0;
  status_.injected += particles_.size();
  return found;
}

}  // namespace pf_resampling
