// How what smoothing works on is saved.

#include "pf_resampling_core/files/archive.hpp"
#include "pf_resampling_core/smoothing/cross_validation.hpp"
#include "pf_resampling_core/smoothing/smoothing_graph.hpp"

namespace pf_resampling {

void describe(Archive& archive, MotionFactor& motion) {
  PF_RESAMPLING_FIELDS(archive, motion.mean, motion.covariance, motion.slip_covariance,
                       motion.sensitivity, motion.turn_share);
}

void describe(Archive& archive, SightingFactor& sighting) {
  PF_RESAMPLING_FIELDS(archive, sighting.pose, sighting.landmark, sighting.range, sighting.bearing,
                       sighting.range_variance, sighting.bearing_variance, sighting.sensor);
}

void describe(Archive& archive, NoiseScales& noise) {
  PF_RESAMPLING_FIELDS(archive, noise.range, noise.bearing, noise.motion);
}

void describe(Archive& archive, PredictionError& error) {
  PF_RESAMPLING_FIELDS(archive, error.error, error.by_ranges, error.by_bearings, error.by_motions,
                       error.by_prior);
}

}  // namespace pf_resampling
