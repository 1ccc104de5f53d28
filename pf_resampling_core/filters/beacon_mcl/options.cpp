#include "pf_resampling_core/filters/beacon_mcl/options.hpp"

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/parameters/enum_names.hpp"

namespace pf_resampling {
namespace {

const EnumNames<CalibrationEstimation> kEstimations{
    "calibration estimation",
    {{CalibrationEstimation::off, "off"},
     {CalibrationEstimation::shared, "shared"},
     {CalibrationEstimation::per_beacon, "per_beacon"}}};
const EnumNames<Initialization> kInitializations{"initialization",
                                                 {{Initialization::from_ranges, "from_ranges"},
                                                  {Initialization::uniform, "uniform"},
                                                  {Initialization::gaussian, "gaussian"}}};

}  // namespace

const std::vector<CalibrationEstimation>& all_calibration_estimations() {
  return kEstimations.values();
}
std::string to_string(CalibrationEstimation estimation) {
  return kEstimations.name(estimation);
}
const std::vector<Initialization>& all_initializations() {
  return kInitializations.values();
}
std::string to_string(Initialization initialization) {
  return kInitializations.name(initialization);
}

ParameterList parameters_of(BeaconMclOptions* options) {
  ParameterList list;
  list.push_back(
      integer_parameter("particles", &options->particles, 1, 10000000, "Number of particles."));
  list.push_back(integer_parameter("threads", &options->threads, 1, 1024,
                                   "Threads of computation; results do not depend on it."));
  add_parameters(&options->strategy, &list);
  add_parameters(&options->odometry, &list);

  RangeModelOptions& ranges = options->ranges;
  list.push_back(real_above_parameter(
      "ranges/sigma", &ranges.sigma, 0.0, 1000.0, "m",
      "Standard deviation of a range where neither message nor calibration has it."));
  list.push_back(real_parameter("ranges/outlier_share", &ranges.outlier_share, 0.0, 0.9, "",
                                "Share of ranges that say nothing."));
  list.push_back(real_above_parameter("ranges/maximum_range", &ranges.maximum_range, 0.0, 1e6, "m",
                                      "Outliers are taken as uniform up to here."));
  list.push_back(real_parameter("ranges/non_line_of_sight_share", &ranges.non_line_of_sight_share,
                                0.0, 0.9, "", "Share of ranges that took a detour."));
  list.push_back(real_above_parameter("ranges/non_line_of_sight_mean",
                                      &ranges.non_line_of_sight_mean, 0.0, 1000.0, "m",
                                      "Mean length of the detour."));

  CalibrationOptions& calibration = options->calibration;
  list.push_back(choice_parameter("calibration/estimation", &calibration.estimation,
                                  all_calibration_estimations(),
                                  "On-line estimation of the ranges' scale and bias."));
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
                        "On-line estimation of a factor of the ranges' standard deviations."));
  list.push_back(real_parameter("noise_estimation/prior_count", &noise.prior_count, 1.0, 1e6, "",
                                "Ranges that the prior, a factor of one, is worth."));
  list.push_back(real_parameter("noise_estimation/memory", &noise.memory, 10.0, 1e9, "",
                                "Ranges after which an old one counts 1/e."));
  list.push_back(boolean_parameter(
      "noise_estimation/odometry", &noise.odometry,
      "On-line estimation of factors of the dead reckoning's standard deviations."));
  list.push_back(
      real_parameter("noise_estimation/odometry_spread", &noise.odometry_spread, 0.0, 3.0, "",
                     "Standard deviation of the logarithm of those factors at the start."));
  list.push_back(real_parameter("noise_estimation/odometry_walk", &noise.odometry_walk, 0.0, 3.0,
                                "", "Random walk of the logarithm of those factors, per renewal."));

  YawRateBiasOptions& yaw_rate_bias = options->yaw_rate_bias;
  list.push_back(boolean_parameter("yaw_rate_bias/estimate", &yaw_rate_bias.estimate,
                                   "On-line estimation of the dead reckoning's yaw-rate bias."));
  list.push_back(real_parameter("yaw_rate_bias/sigma", &yaw_rate_bias.sigma, 0.0, 1.0, "rad/s",
                                "Standard deviation of the bias at the start."));
  list.push_back(real_parameter("yaw_rate_bias/walk", &yaw_rate_bias.walk, 0.0, 1.0,
                                "rad/s/sqrt(s)", "Random walk of the bias."));

  InitializationOptions& initialization = options->initialization;
  list.push_back(choice_parameter("initialization/method", &initialization.method,
                                  all_initializations(), "Where the particles start."));
  list.push_back(integer_parameter("initialization/beacons", &initialization.beacons, 1, 100,
                                   "from_ranges: different beacons to wait for."));
  list.push_back(real_parameter("initialization/patience", &initialization.patience, 0.0, 1e6, "s",
                                "from_ranges: start with fewer beacons after this long."));
  list.push_back(real_parameter(
      "initialization/area_margin", &initialization.area_margin, 0.0, 10.0, "",
      "uniform: share of its diagonal by which the beacons' bounding box is widened."));
  list.push_back(
      real_parameter("initialization/x", &initialization.x, -1e7, 1e7, "m", "gaussian: mean."));
  list.push_back(
      real_parameter("initialization/y", &initialization.y, -1e7, 1e7, "m", "gaussian: mean."));
  list.push_back(real_parameter("initialization/heading", &initialization.heading, -6.3, 6.3, "rad",
                                "gaussian: mean."));
  list.push_back(real_parameter("initialization/sigma_position", &initialization.sigma_position,
                                0.0, 1e5, "m", "gaussian: standard deviation per axis."));
  list.push_back(real_parameter("initialization/sigma_heading", &initialization.sigma_heading, 0.0,
                                6.3, "rad", "gaussian: standard deviation."));

  RecoveryOptions& recovery = options->recovery;
  list.push_back(boolean_parameter(
      "recovery/enabled", &recovery.enabled,
      "Inject particles drawn from the latest ranges when these become unlikely."));
  list.push_back(
      real_above_parameter("recovery/slow_rate", &recovery.slow_rate, 0.0, 1.0, "",
                           "Weight of a new range in the long-term average likelihood."));
  list.push_back(
      real_above_parameter("recovery/fast_rate", &recovery.fast_rate, 0.0, 1.0, "",
                           "Weight of a new range in the short-term average likelihood."));
  list.push_back(real_parameter(
      "recovery/threshold", &recovery.threshold, 0.0, 1.0, "",
      "Inject when the short-term average is below this share of the long-term one."));
  list.push_back(real_parameter("recovery/maximum_share", &recovery.maximum_share, 0.0, 1.0, "",
                                "Largest share of the population injected at once."));
  list.push_back(
      real_parameter("recovery/window", &recovery.window, 0.0, 1e4, "s",
                     "Injected particles agree with the ranges of this stretch of time."));

  AdaptiveCountOptions& adaptive = options->adaptive_count;
  list.push_back(boolean_parameter("adaptive_count/enabled", &adaptive.enabled,
                                   "Particle count by the Kullback-Leibler distance (Fox 2003)."));
  list.push_back(integer_parameter("adaptive_count/minimum", &adaptive.minimum, 1, 10000000,
                                   "Fewest particles."));
  list.push_back(integer_parameter("adaptive_count/maximum", &adaptive.maximum, 1, 10000000,
                                   "Most particles."));
  list.push_back(real_above_parameter("adaptive_count/error", &adaptive.error, 0.0, 1.0, "",
                                      "Bound of the distance to the discretised belief."));
  list.push_back(real_parameter("adaptive_count/quantile", &adaptive.quantile, 0.0, 10.0, "",
                                "Standard normal quantile of the certainty of that bound."));
  list.push_back(real_above_parameter("adaptive_count/bin_position", &adaptive.bin_position, 0.0,
                                      1e4, "m", "Side of a bin of the discretised belief."));
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
