#include "fastslam_node/landmark_checks.hpp"

#include <cmath>

#include "pf_resampling/input_checks.hpp"

namespace pf_resampling {

std::optional<Rejection> check(const LandmarkObservationArray& scan) {
  if (scan.header.stamp.isZero()) return rejection(RejectReason::no_stamp, "the stamp is zero");
  return std::nullopt;
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
  if (!std::isfinite(z.range_variance) || !std::isfinite(z.bearing_variance)) {
    return rejection(RejectReason::not_finite, "the variances of landmark ", z.id, " are ",
                     z.range_variance, " m^2 and ", z.bearing_variance, " rad^2");
  }
  if (z.range_variance < 0.0 || z.bearing_variance < 0.0) {
    return rejection(RejectReason::impossible_variance, "the variances of landmark ", z.id, " are ",
                     z.range_variance, " m^2 and ", z.bearing_variance, " rad^2");
  }
  return std::nullopt;
}

}  // namespace pf_resampling
