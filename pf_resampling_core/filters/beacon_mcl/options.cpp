#include "pf_resampling_core/filters/beacon_mcl/options.hpp"

#include <algorithm>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {

const EnumNames<BeaconPositions>& names_of(BeaconPositions) {
  static const EnumNames<BeaconPositions> names(
      "beacon positions",
      {{BeaconPositions::known, "known"}, {BeaconPositions::estimated, "estimated"}});
  return names;
}

const EnumNames<CalibrationEstimation>& names_of(CalibrationEstimation) {
  static const EnumNames<CalibrationEstimation> names(
      "calibration estimation",
      {{CalibrationEstimation::off, "off"}, {CalibrationEstimation::shared, "shared"}});
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
  list.push_back(basic(
      integer_parameter("particles", &options->particles, 1, 10000000, "Number of particles.")));
  list.push_back(integer_parameter("threads", &options->threads, 1, 1024,
                                   "Number of threads; results do not depend on it."));
  add_parameters(&options->strategy, all_values<Renewal>(), &list);
  // A memory of ranges knows itself when to draw.
  list.erase(std::remove_if(list.begin(), list.end(),
                            [](const Parameter& parameter) {
                              return parameter.name.rfind("population/redraw/", 0) == 0;
                            }),
             list.end());
  add_parameters(&options->odometry, &list);

  RangeModelOptions& ranges = options->ranges;
  list.push_back(basic(real_above_parameter(
      "ranges/sigma", &ranges.sigma, 0.0, 1000.0, "m",
      "Standard deviation of a range, if neither the message nor the calibration gives one.")));
  list.push_back(real_parameter("ranges/outlier_share", &ranges.outlier_share, 0.0, 0.9, "",
                                "Probability that a range is an outlier."));

  CalibrationOptions& calibration = options->calibration;
  list.push_back(basic(choice_parameter("calibration/estimation", &calibration.estimation,
                                        "Online estimation of scale and bias of the ranges: off, "
                                        "or shared by all beacons; redraw finds each's own.")));

  NoiseEstimationOptions& noise = options->noise_estimation;
  list.push_back(
      boolean_parameter("noise_estimation/ranges", &noise.ranges,
                        "Estimate a factor on the standard deviation of the ranges online."));
  list.push_back(
      boolean_parameter("noise_estimation/odometry", &noise.odometry,
                        "Estimate factors on the standard deviations of the odometry online."));

  YawRateBiasOptions& yaw_rate_bias = options->yaw_rate_bias;
  list.push_back(boolean_parameter("yaw_rate_bias/estimate", &yaw_rate_bias.estimate,
                                   "Estimate the yaw-rate bias of the odometry online."));

  InitializationOptions& initialization = options->initialization;
  list.push_back(basic(choice_parameter("initialization/method", &initialization.method,
                                        "Initial distribution: from the first ranges, uniform "
                                        "around the beacons, or Gaussian about a given pose.")));
  list.push_back(real_parameter("initialization/patience", &initialization.patience, 0.0, 1e6, "s",
                                "from_ranges: after this time, start with fewer beacons."));
  list.push_back(
      real_parameter("initialization/x", &initialization.x, -1e7, 1e7, "m", "gaussian: mean."));
  list.push_back(
      real_parameter("initialization/y", &initialization.y, -1e7, 1e7, "m", "gaussian: mean."));
  list.push_back(real_parameter("initialization/heading", &initialization.heading, -6.3, 6.3, "rad",
                                "gaussian: mean."));

  RecoveryOptions& recovery = options->recovery;
  list.push_back(basic(boolean_parameter(
      "recovery/enabled", &recovery.enabled,
      "When the ranges become unlikely, inject particles where the latest ranges fit.")));
  return list;
}

void validate(const BeaconMclOptions& options) {
  BeaconMclOptions copy = options;
  for (const Parameter& parameter : parameters_of(&copy)) parameter.set_checked(parameter.get());
  if (options.beacon_positions == BeaconPositions::estimated &&
      options.strategy.renewal != Renewal::redraw) {
    throw Error("parameter beacon_positions is estimated, which needs population/renewal redraw");
  }
  const Strategy strategy(options.strategy);
}

}  // namespace pf_resampling
