#include "pf_resampling_core/filters/beacon_mcl/options.hpp"

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {

const EnumNames<CalibrationEstimation>& names_of(CalibrationEstimation) {
  static const EnumNames<CalibrationEstimation> names(
      "calibration estimation", {{CalibrationEstimation::off, "off"},
                                 {CalibrationEstimation::shared, "shared"},
                                 {CalibrationEstimation::per_beacon, "per_beacon"}});
  return names;
}

const EnumNames<Initialization>& names_of(Initialization) {
  static const EnumNames<Initialization> names("initialization",
                                               {{Initialization::from_ranges, "from_ranges"},
                                                {Initialization::uniform, "uniform"},
                                                {Initialization::gaussian, "gaussian"}});
  return names;
}

ParameterList parameters_of(BeaconMclOptions* options) {
  ParameterList list;
  list.push_back(
      integer_parameter("particles", &options->particles, 1, 10000000, "Number of particles."));
  list.push_back(integer_parameter("threads", &options->threads, 1, 1024,
                                   "Number of threads; results do not depend on it."));
  add_parameters(&options->strategy, renewals_without_redraw(), &list);
  add_parameters(&options->odometry, &list);

  RangeModelOptions& ranges = options->ranges;
  list.push_back(real_above_parameter(
      "ranges/sigma", &ranges.sigma, 0.0, 1000.0, "m",
      "Standard deviation of a range, if neither the message nor the calibration gives one."));
  list.push_back(real_parameter("ranges/outlier_share", &ranges.outlier_share, 0.0, 0.9, "",
                                "Share of ranges that are outliers."));
  list.push_back(real_above_parameter("ranges/maximum_range", &ranges.maximum_range, 0.0, 1e6, "m",
                                      "Outliers are assumed to be uniform from 0 to this range."));
  list.push_back(
      real_parameter("ranges/non_line_of_sight_share", &ranges.non_line_of_sight_share, 0.0, 0.9,
                     "", "Share of ranges that are too long because the signal was reflected."));
  list.push_back(real_above_parameter("ranges/non_line_of_sight_mean",
                                      &ranges.non_line_of_sight_mean, 0.0, 1000.0, "m",
                                      "Mean excess length of a reflected range."));

  CalibrationOptions& calibration = options->calibration;
  list.push_back(choice_parameter("calibration/estimation", &calibration.estimation,
                                  "Estimate scale and bias of the ranges on line: not at all, "
                                  "shared by all beacons, or for each beacon."));
  list.push_back(real_parameter("calibration/scale_sigma", &calibration.scale_sigma, 0.0, 1.0, "",
                                "Standard deviation of the scale before the first range."));
  list.push_back(real_parameter("calibration/bias_sigma", &calibration.bias_sigma, 0.0, 100.0, "m",
                                "Standard deviation of the bias before the first range."));
  list.push_back(real_parameter("calibration/scale_walk", &calibration.scale_walk, 0.0, 1.0,
                                "1/sqrt(s)", "Random walk of the scale."));
  list.push_back(real_parameter("calibration/bias_walk", &calibration.bias_walk, 0.0, 10.0,
                                "m/sqrt(s)", "Random walk of the bias."));

  NoiseEstimationOptions& noise = options->noise_estimation;
  list.push_back(
      boolean_parameter("noise_estimation/ranges", &noise.ranges,
                        "Estimate a factor on the standard deviation of the ranges on line."));
  list.push_back(real_parameter("noise_estimation/prior_count", &noise.prior_count, 1.0, 1e6, "",
                                "How many ranges the prior (a factor of 1) counts as much as."));
  list.push_back(real_parameter("noise_estimation/memory", &noise.memory, 10.0, 1e9, "",
                                "After this many newer ranges, an old one counts 1/e."));
  list.push_back(
      boolean_parameter("noise_estimation/odometry", &noise.odometry,
                        "Estimate factors on the standard deviations of the odometry on line."));
  list.push_back(
      real_parameter("noise_estimation/odometry_spread", &noise.odometry_spread, 0.0, 3.0, "",
                     "Standard deviation of the logarithm of those factors at the start."));
  list.push_back(real_parameter(
      "noise_estimation/odometry_walk", &noise.odometry_walk, 0.0, 3.0, "",
      "Random walk of the logarithm of those factors, per renewal of the population."));

  YawRateBiasOptions& yaw_rate_bias = options->yaw_rate_bias;
  list.push_back(boolean_parameter("yaw_rate_bias/estimate", &yaw_rate_bias.estimate,
                                   "Estimate the yaw-rate bias of the odometry on line."));
  list.push_back(real_parameter("yaw_rate_bias/sigma", &yaw_rate_bias.sigma, 0.0, 1.0, "rad/s",
                                "Standard deviation of the bias at the start."));
  list.push_back(real_parameter("yaw_rate_bias/walk", &yaw_rate_bias.walk, 0.0, 1.0,
                                "rad/s/sqrt(s)", "Random walk of the bias."));

  InitializationOptions& initialization = options->initialization;
  list.push_back(choice_parameter("initialization/method", &initialization.method,
                                  "How the particles start: from the first ranges, anywhere around "
                                  "the beacons, or around a given pose."));
  list.push_back(integer_parameter("initialization/beacons", &initialization.beacons, 1, 100,
                                   "from_ranges: wait for ranges to this many beacons."));
  list.push_back(real_parameter("initialization/patience", &initialization.patience, 0.0, 1e6, "s",
                                "from_ranges: start with fewer beacons after this long."));
  list.push_back(real_parameter(
      "initialization/area_margin", &initialization.area_margin, 0.0, 10.0, "",
      "uniform: widen the bounding box of the beacons by this share of its diagonal."));
  list.push_back(
      real_parameter("initialization/x", &initialization.x, -1e7, 1e7, "m", "gaussian: mean."));
  list.push_back(
      real_parameter("initialization/y", &initialization.y, -1e7, 1e7, "m", "gaussian: mean."));
  list.push_back(real_parameter("initialization/heading", &initialization.heading, -6.3, 6.3, "rad",
                                "gaussian: mean."));
  list.push_back(real_parameter("initialization/sigma_position", &initialization.sigma_position,
                                0.0, 1e5, "m",
                                "gaussian: standard deviation of the position, per axis."));
  list.push_back(real_parameter("initialization/sigma_heading", &initialization.sigma_heading, 0.0,
                                6.3, "rad", "gaussian: standard deviation."));

  RecoveryOptions& recovery = options->recovery;
  list.push_back(boolean_parameter(
      "recovery/enabled", &recovery.enabled,
      "When the ranges become unlikely, add particles at places that fit the latest ranges."));
  list.push_back(
      real_above_parameter("recovery/slow_rate", &recovery.slow_rate, 0.0, 1.0, "",
                           "Weight of a new range in the long-term average likelihood."));
  list.push_back(
      real_above_parameter("recovery/fast_rate", &recovery.fast_rate, 0.0, 1.0, "",
                           "Weight of a new range in the short-term average likelihood."));
  list.push_back(real_parameter(
      "recovery/threshold", &recovery.threshold, 0.0, 1.0, "",
      "Add particles when the short-term average is below this share of the long-term average."));
  list.push_back(real_parameter("recovery/maximum_share", &recovery.maximum_share, 0.0, 1.0, "",
                                "Largest share of the particles that is replaced at once."));
  list.push_back(real_parameter("recovery/window", &recovery.window, 0.0, 1e4, "s",
                                "Added particles fit the ranges of this much time."));

  AdaptiveCountOptions& adaptive = options->adaptive_count;
  list.push_back(boolean_parameter(
      "adaptive_count/enabled", &adaptive.enabled,
      "Choose the number of particles by the Kullback-Leibler distance (Fox 2003)."));
  list.push_back(integer_parameter("adaptive_count/minimum", &adaptive.minimum, 1, 10000000,
                                   "Fewest particles."));
  list.push_back(integer_parameter("adaptive_count/maximum", &adaptive.maximum, 1, 10000000,
                                   "Most particles."));
  list.push_back(
      real_above_parameter("adaptive_count/error", &adaptive.error, 0.0, 1.0, "",
                           "Largest Kullback-Leibler distance to the distribution in bins."));
  list.push_back(real_parameter(
      "adaptive_count/quantile", &adaptive.quantile, 0.0, 10.0, "",
      "Quantile of the standard normal distribution for the confidence in that distance."));
  list.push_back(real_above_parameter("adaptive_count/bin_position", &adaptive.bin_position, 0.0,
                                      1e4, "m", "Side of a bin in x and y."));
  list.push_back(real_above_parameter("adaptive_count/bin_heading", &adaptive.bin_heading, 0.0, 6.3,
                                      "rad", "Width of a bin in heading."));
  return list;
}

void validate(const BeaconMclOptions& options) {
  BeaconMclOptions copy = options;
  for (const Parameter& parameter : parameters_of(&copy)) parameter.set_checked(parameter.get());
  if (options.adaptive_count.minimum > options.adaptive_count.maximum) {
    throw Error("parameter adaptive_count/minimum is " +
                std::to_string(options.adaptive_count.minimum) +
                ", has to be at most adaptive_count/maximum, which is " +
                std::to_string(options.adaptive_count.maximum));
  }
  if (options.ranges.outlier_share + options.ranges.non_line_of_sight_share >= 1.0) {
    throw Error("parameters ranges/outlier_share and ranges/non_line_of_sight_share are " +
                std::to_string(options.ranges.outlier_share) + " and " +
                std::to_string(options.ranges.non_line_of_sight_share) +
                ", have to add up to less than 1");
  }
  const Strategy strategy(options.strategy);
}

}  // namespace pf_resampling
