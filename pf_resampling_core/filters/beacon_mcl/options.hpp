#pragma once

#include "pf_resampling_core/models/odometry_motion.hpp"
#include "pf_resampling_core/parameters/parameters.hpp"
#include "pf_resampling_core/strategy/strategy.hpp"

namespace pf_resampling {

/// Whether all beacons are where they are listed.
enum class BeaconPositions {
  known,
  estimated,  ///< those that are not listed are found; their number, too
};
const EnumNames<BeaconPositions>& names_of(BeaconPositions);

/// Whether scale and bias of the ranges are estimated on line.
enum class CalibrationEstimation {
  off,     ///< the given calibration is believed
  shared,  ///< one scale and one bias for all radios
};
const EnumNames<CalibrationEstimation>& names_of(CalibrationEstimation);

/// Where the particles start.
enum class Initialization {
  from_ranges,  ///< where the first ranges allow, any heading
  uniform,      ///< over the area, any heading
  gaussian,     ///< about a given pose
};
const EnumNames<Initialization>& names_of(Initialization);

/// Likelihood of a range r at distance d: a Gaussian about scale * d + bias, and a uniform floor
/// for outliers.
struct RangeModelOptions {
  double sigma = 1.0;  ///< m, where neither message nor calibration has it; learnt from there
  double outlier_share = 0.05;
  double maximum_range = 200.0;  ///< m, width of the uniform floor
};

/// Given a pose, a range is linear in scale and bias: each particle carries a Kalman filter for
/// them.
struct CalibrationOptions {
  CalibrationEstimation estimation = CalibrationEstimation::shared;
  double scale_sigma = 0.05;  ///< of the prior: a few per cent, as radios are off
  double bias_sigma = 0.5;    ///< m, of the prior
  double scale_walk = 1e-4;   ///< 1/sqrt(s)
  double bias_walk = 1e-3;    ///< m/sqrt(s)
};

/// Noise is known to a factor only, which is learnt on line. That of the ranges by
/// expectation-maximisation (Cappe 2011, "Online EM algorithm for hidden Markov models"). Those of
/// the dead reckoning by selection: every particle has its own, and those that predict well survive
/// (Kitagawa 1998, "A self-organizing state-space model").
struct NoiseEstimationOptions {
  bool ranges = true;            ///< factor of the standard deviation of all ranges
  double prior_count = 50.0;     ///< weight of the prior, a factor of one, in ranges
  double memory = 500.0;         ///< ranges after which an old one counts 1/e
  bool odometry = true;          ///< factors of the standard deviations of translation and heading
  double odometry_spread = 0.5;  ///< standard deviation of their logarithm at the start
  double odometry_walk = 0.1;    ///< and of what is added to it at each renewal
};

/// Error of the dead reckoning's yaw rate, a Kalman filter per particle as well.
struct YawRateBiasOptions {
  bool estimate = true;
  double sigma = 0.01;  ///< rad/s, of the prior
  double walk = 1e-5;   ///< rad/s/sqrt(s)
};

struct InitializationOptions {
  Initialization method = Initialization::from_ranges;
  int beacons = 3;        ///< from_ranges: different beacons to wait for; three make a point
  double patience = 5.0;  ///< s: from_ranges: start with fewer after this long
  /// uniform: the beacons' bounding box, widened by this share of its diagonal.
  double area_margin = 0.2;
  double x = 0.0, y = 0.0, heading = 0.0;  ///< gaussian
  double sigma_position = 1.0;             ///< m
  double sigma_heading = 0.3;              ///< rad
};

/// Injection of particles drawn from the latest ranges when the likelihood of the ranges drops
/// (augmented MCL: Thrun, Burgard, Fox, Probabilistic Robotics, table 8.3).
struct RecoveryOptions {
  bool enabled = true;
  /// Of the average likelihoods, per range: 200 ranges are what is usual, 10 are what is now.
  static constexpr double slow_rate = 0.005, fast_rate = 0.1;
  /// Share of the long-term average below which particles are injected.
  static constexpr double threshold = 0.5;
  /// Of the population, per renewal: half stays, in case that the ranges are wrong.
  static constexpr double maximum_share = 0.5;
  /// s of ranges that injected particles have to agree with: several of each beacon.
  static constexpr double window = 6.0;
};

/// Everything BeaconMcl can be told, with the only defaults there are. Names, units and ranges:
/// parameters_of().
struct BeaconMclOptions {
  int particles = 1000;
  int threads = 1;
  BeaconPositions beacon_positions = BeaconPositions::known;
  StrategyOptions strategy;
  OdometryNoise odometry;
  RangeModelOptions ranges;
  CalibrationOptions calibration;
  NoiseEstimationOptions noise_estimation;
  YawRateBiasOptions yaw_rate_bias;
  InitializationOptions initialization;
  RecoveryOptions recovery;
};

/// Every parameter that a filter can change, bound to `options`, which must outlive the list.
ParameterList parameters_of(BeaconMclOptions* options);

/// Throws Error naming the first combination that makes no sense (single ranges are checked when
/// set).
void validate(const BeaconMclOptions& options);

}  // namespace pf_resampling
