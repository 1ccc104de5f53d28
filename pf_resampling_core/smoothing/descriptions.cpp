// How what smoothing works on is saved.

#include "pf_resampling_core/files/archive.hpp"
#include "pf_resampling_core/smoothing/cross_validation.hpp"
#include "pf_resampling_core/smoothing/smoothing_graph.hpp"

namespace pf_resampling {

void describe(Archive& archive, MotionFactor& motion) {
  archive("mean", motion.mean);
  archive("covariance", motion.covariance);
  archive("slip_covariance", motion.slip_covariance);
  archive("sensitivity", motion.sensitivity);
  archive("turn_share", motion.turn_share);
}

void describe(Archive& archive, SightingFactor& sighting) {
  archive("pose", sighting.pose);
  archive("landmark", sighting.landmark);
  archive("range", sighting.range);
  archive("bearing", sighting.bearing);
  archive("range_variance", sighting.range_variance);
  archive("bearing_variance", sighting.bearing_variance);
  archive("sensor", sighting.sensor);
}

void describe(Archive& archive, NoiseScales& noise) {
  archive("range", noise.range);
  archive("bearing", noise.bearing);
  archive("motion", noise.motion);
}

void describe(Archive& archive, PredictionError& error) {
  archive("error", error.error);
  archive("by_ranges", error.by_ranges);
  archive("by_bearings", error.by_bearings);
  archive("by_motions", error.by_motions);
  archive("by_prior", error.by_prior);
}

}  // namespace pf_resampling
