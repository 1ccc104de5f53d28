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

std::vector<ResamplingScheme> inner_schemes() {
  std::vector<ResamplingScheme> inner;
  for (const ResamplingScheme scheme : all_resampling_schemes()) {
    if (scheme != ResamplingScheme::partial && scheme != ResamplingScheme::rank_based)
      inner.push_back(scheme);
  }
  return inner;
}

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

void add_parameters(PopulationControlOptions* options, ExcitationOptions* excitation,
                    ParameterList* parameters) {
  ResamplingOptions& resampling = options->resampling;
  ParameterList& list = *parameters;
  list.push_back(choice_parameter("population/schedule", &options->schedule, all_schedules(),
                                  "When the population is renewed."));
  list.push_back(real_above_parameter("population/threshold", &options->threshold, 0.0, 1.0, "",
                                      "Renew when N_eff falls below this share of the particles."));
  list.push_back(integer_parameter("population/every_n", &options->every_n, 1, 1000000,
                                   "Observations between renewals under every_n."));
  list.push_back(choice_parameter("population/renewal", &options->renewal, all_renewals(),
                                  "How the population is renewed."));
  list.push_back(choice_parameter("population/resampling/scheme", &resampling.scheme,
                                  all_resampling_schemes(), "Resampling scheme."));
  list.push_back(choice_parameter("population/resampling/inner_scheme", &resampling.inner_scheme,
                                  inner_schemes(), "Scheme inside partial and rank_based."));
  list.push_back(real_parameter("population/resampling/partial_high", &resampling.partial_high, 1.0,
                                1000.0, "",
                                "partial: weights above this multiple of 1/M take part."));
  list.push_back(real_parameter("population/resampling/partial_low", &resampling.partial_low, 0.0,
                                1.0, "", "partial: weights below this multiple of 1/M take part."));
  list.push_back(
      real_parameter("population/resampling/rank_max", &resampling.rank_max, 1.0, 2.0, "",
                     "rank_based: eta_max, times 1/M the probability of the best particle."));
  list.push_back(choice_parameter("population/resampling/weights_after", &resampling.weights_after,
                                  all_weights_after(), "Weights after partial and rank_based."));
  CompensationOptions& compensation = options->compensation;
  list.push_back(choice_parameter("population/compensation/pairing", &compensation.pairing,
                                  all_pairings(),
                                  "How a weak particle finds the strong one it is blended with."));
  list.push_back(real_above_parameter("population/compensation/ratio", &compensation.ratio, 0.0,
                                      1.0, "",
                                      "Share of the weak half that is compensated, worst first."));
  list.push_back(choice_parameter("population/compensation/covariance", &compensation.covariance,
                                  all_covariance_treatments(),
                                  "What becomes of a blended landmark's covariance."));
  list.push_back(choice_parameter("population/compensation/weights_after",
                                  &compensation.weights_after, all_compensated_weights(),
                                  "Weights after a compensation."));
  list.push_back(choice_parameter("excitation/method", &excitation->excitation, all_excitations(),
                                  "Perturbation of the particles after a renewal."));
  list.push_back(real_parameter("excitation/sigma_position", &excitation->sigma_position, 0.0,
                                100.0, "m", "gaussian: standard deviation per axis."));
  list.push_back(real_parameter("excitation/sigma_heading", &excitation->sigma_heading, 0.0, 3.2,
                                "rad", "gaussian: standard deviation of the heading."));
  list.push_back(real_parameter("excitation/bandwidth_scale", &excitation->bandwidth_scale, 0.0,
                                2.0, "", "regularized: multiple of Silverman's bandwidth."));
  list.push_back(
      boolean_parameter("excitation/keep_variance", &excitation->keep_variance,
                        "regularized: pull towards the mean so that the variance is kept."));
  list.push_back(real_parameter("excitation/roughening_scale", &excitation->roughening_scale, 0.0,
                                1.0, "", "roughening: Gordon's K."));
  list.push_back(boolean_parameter("excitation/duplicates_only", &excitation->duplicates_only,
                                   "Leave the first copy of each ancestor where it is."));
}

void add_parameters(OdometryNoise* noise, ParameterList* parameters) {
  OdometryNoise& odometry = *noise;
  ParameterList& list = *parameters;
  list.push_back(real_parameter("odometry/translation_per_distance",
                                &odometry.translation_per_distance, 0.0, 10.0, "m/sqrt(m)",
                                "Standard deviation of the distance after one metre."));
  list.push_back(real_parameter("odometry/slip_per_distance", &odometry.slip_per_distance, 0.0,
                                10.0, "m/sqrt(m)",
                                "Standard deviation of the sideways offset after one metre."));
  list.push_back(real_parameter("odometry/heading_per_distance", &odometry.heading_per_distance,
                                0.0, 10.0, "rad/sqrt(m)",
                                "Standard deviation of the heading after one metre."));
  list.push_back(real_parameter("odometry/heading_per_angle", &odometry.heading_per_angle, 0.0,
                                10.0, "rad/sqrt(rad)",
                                "Standard deviation of the heading after one radian turned."));
  list.push_back(real_parameter("odometry/heading_per_time", &odometry.heading_per_time, 0.0, 10.0,
                                "rad/sqrt(s)",
                                "Standard deviation of the heading after one second."));
  list.push_back(real_parameter("odometry/along_per_time", &odometry.along_per_time, 0.0, 10.0,
                                "m/sqrt(s)",
                                "Standard deviation along the motion after one second."));
  list.push_back(real_parameter("odometry/translation_per_time", &odometry.translation_per_time,
                                0.0, 10.0, "m/sqrt(s)",
                                "Standard deviation along both axes after one second."));
}

ParameterList parameters_of(BeaconMclOptions* options) {
  ParameterList list;
  list.push_back(
      integer_parameter("particles", &options->particles, 1, 10000000, "Number of particles."));
  list.push_back(integer_parameter("threads", &options->threads, 1, 1024,
                                   "Threads of computation; results do not depend on it."));
  add_parameters(&options->population, &options->excitation, &list);

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
  Resampler resampler(options.population.resampling);
  PopulationControl control(options.population);
}

}  // namespace pf_resampling
