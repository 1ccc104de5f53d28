#include "fastslam_node/landmark_checks.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "src/diagnostics/diagnostics.hpp"
#include "src/odometry/input_checks.hpp"

namespace pf_resampling {
namespace {

// What a filter's numbers can be reckoned with; no sensor comes near.
constexpr double kFarthest = 1e6;                // m
constexpr double kLargestBearingVariance = 1e4;  // rad^2
constexpr double kSmallestVariance = 1e-12;      // of a micrometre, or a microradian

/// Zero: unknown.
bool is_possible(double variance, double largest) {
  return variance == 0.0 || (variance >= kSmallestVariance && variance <= largest);
}

// m, between what may be two sightings of one landmark.
constexpr double kSamePlace = 0.3;

double distance(const LandmarkObservation& a, const LandmarkObservation& b) {
  return std::sqrt(std::max(0.0, a.range * a.range + b.range * b.range -
                                     2.0 * a.range * b.range * std::cos(a.bearing - b.bearing)));
}

}  // namespace

std::optional<Rejection> check(const LandmarkObservationArray& scan, int most) {
  if (scan.observations.size() > static_cast<std::size_t>(most)) {
    return rejection(RejectReason::too_many, "the scan has ", scan.observations.size(),
                     " observations, more than the limit of ", most);
  }
  return check(scan.header.stamp);
}

std::optional<Rejection> check(const LandmarkObservation& observation) {
  const auto& z = observation;
  if (!std::isfinite(z.range) || !std::isfinite(z.bearing)) {
    return rejection(RejectReason::not_finite, "landmark ", z.id, " is seen at a range of ",
                     z.range, " m and a bearing of ", z.bearing, " rad");
  }
  if (z.range <= 0.0) {
    return rejection(RejectReason::not_positive, "the range to landmark ", z.id, " is ", z.range,
                     " m");
  }
  if (z.range > kFarthest) {
    return rejection(RejectReason::impossible_range, "the range to landmark ", z.id, " is ",
                     z.range, " m");
  }
  if (!std::isfinite(z.range_variance) || !std::isfinite(z.bearing_variance)) {
    return rejection(RejectReason::not_finite, "the variances of landmark ", z.id, " are ",
                     z.range_variance, " m^2 and ", z.bearing_variance, " rad^2");
  }
  if (!is_possible(z.range_variance, kFarthest * kFarthest) ||
      !is_possible(z.bearing_variance, kLargestBearingVariance)) {
    return rejection(RejectReason::impossible_variance, "the variances of landmark ", z.id, " are ",
                     z.range_variance, " m^2 and ", z.bearing_variance, " rad^2");
  }
  return std::nullopt;
}

std::optional<Rejection> check_repeated(const LandmarkObservation& observation,
                                        const LandmarkObservationArray& scan) {
  for (const LandmarkObservation& other : scan.observations) {
    if (&other == &observation) return std::nullopt;
    if (other.id == observation.id && !check(other) && distance(other, observation) <= kSamePlace) {
      return rejection(RejectReason::repeated, "the id ", observation.id,
                       " appears twice in a scan, in the same position: the first is used");
    }
  }
  return std::nullopt;
}

std::string id_at_two_places(const LandmarkObservationArray& scan) {
  std::map<int, const LandmarkObservation*> seen;
  for (const LandmarkObservation& observation : scan.observations) {
    if (observation.id < 0 || check(observation)) continue;
    const auto [other, is_new] = seen.emplace(observation.id, &observation);
    if (is_new || !(distance(*other->second, observation) > kSamePlace)) continue;
    return "the id " + std::to_string(observation.id) + " appears twice in a scan, " +
           number_text(distance(*other->second, observation)) +
           " m apart: misread, or two landmarks with one id? Only observations that fit the map "
           "are used";
  }
  return "";
}

}  // namespace pf_resampling
