#pragma once

#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {

/// One landmark as seen from the sensor.
struct RangeBearingObservation {
  int id = -1;                    ///< -1: unknown
  double range = 0.0;             ///< m, > 0
  double bearing = 0.0;           ///< rad, counter-clockwise from the sensor's x axis
  double range_variance = 0.0;    ///< m^2; 0: the model's own
  double bearing_variance = 0.0;  ///< rad^2; 0: the model's own
};

}  // namespace pf_resampling
