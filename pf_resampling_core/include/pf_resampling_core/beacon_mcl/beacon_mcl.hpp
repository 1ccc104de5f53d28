#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "pf_resampling_core/excitation/excitation.hpp"
#include "pf_resampling_core/models/beacon_range.hpp"
#include "pf_resampling_core/models/odometry_motion.hpp"
#include "pf_resampling_core/parameters.hpp"
#include "pf_resampling_core/population/ancestry.hpp"
#include "pf_resampling_core/population_control.hpp"

namespace pf_resampling {

/// Whether scale and bias of the ranges are estimated on line, and for whom.
enum class CalibrationEstimation {
  off,         ///< the given calibration is believed
  shared,      ///< one scale and one bias for all radios
  per_beacon,  ///< one of each per beacon
};
std::string to_string(CalibrationEstimation estimation);
const std::vector<CalibrationEstimation>& all_calibration_estimations();

/// Where the particles start.
enum class Initialization {
  from_ranges,  ///< on the rings of the first ranges, any heading
  uniform,      ///< over the area, any heading
  gaussian,     ///< about a given pose
};
std::string to_string(Initialization initialization);
const std::vector<Initialization>& all_initializations();

struct BeaconMclOptions;  // beacon_mcl/options.hpp

/// What the filter believes, in the map frame.
struct PoseEstimate {
  Pose2 mean;  ///< weighted mean; the heading on the circle
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of (x, y, heading), about that mean
};

/// What the last update did; all counts since the start unless said otherwise.
struct BeaconMclStatus {
  int particles = 0;
  double effective_sample_size = 0.0;  ///< before the renewal of the last update, if there was one
  double entropy_sample_size = 0.0;    ///< likewise
  int distinct_ancestors = 0;          ///< of the last renewal
  bool renewed = false;                ///< whether the last update renewed the population
  std::int64_t updates = 0;
  std::int64_t renewals = 0;
  std::int64_t weight_resets = 0;  ///< times all weights vanished and were reset to uniform
  std::int64_t injected = 0;       ///< particles injected so far
  double log_likelihood = 0.0;     ///< of the last update's ranges
  double innovation = 0.0;         ///< m, last range minus its prediction by the estimate
  double innovation_sigma = 0.0;   ///< m, its expected standard deviation
};

/// Estimated systematic errors, averaged over the particles.
struct CalibrationEstimate {
  int beacon = 0;  ///< id; -1 where shared by all
  double scale = 1.0, scale_sigma = 0.0;
  double bias = 0.0, bias_sigma = 0.0;  ///< m
};

/// Monte Carlo localization by ranges to known beacons (M section III). Steps of an update: move by
/// odometry, weigh by the ranges, renew the population when due, excite.
class BeaconMcl;

}  // namespace pf_resampling
