#include "pf_resampling_core/filters/fastslam/options.hpp"

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
const EnumNames<FastSlamVersion>& names_of(FastSlamVersion) {
  static const EnumNames<FastSlamVersion> names(
      "FastSLAM version",
      {{FastSlamVersion::fastslam_1, "fastslam_1"}, {FastSlamVersion::fastslam_2, "fastslam_2"}});
  return names;
}

const EnumNames<DataAssociation>& names_of(DataAssociation) {
  static const EnumNames<DataAssociation> names(
      "data association", {{DataAssociation::automatic, "automatic"},
                           {DataAssociation::known, "known"},
                           {DataAssociation::maximum_likelihood, "maximum_likelihood"},
                           {DataAssociation::mutual_exclusion, "mutual_exclusion"}});
  return names;
}

FastSlamOptions::FastSlamOptions() {
  strategy.threshold = 0.75;  // Kwak section 4.2
  // A wheeled robot of any size; what of its errors is constant is estimated (odometry_errors).
  odometry.heading_per_time = 0.02;
  // The proposal spreads the poses already; Kwak perturbs nothing.
  strategy.excitation.method = Excitation::none;
}

ParameterList parameters_of(FastSlamOptions* options) {
  ParameterList list;
  list.push_back(basic(
      integer_parameter("particles", &options->particles, 1, 1000000, "Number of particles.")));
  list.push_back(choice_parameter("version", &options->version,
                                  "Poses are drawn from the odometry alone (FastSLAM 1.0), or from "
                                  "odometry and observations (2.0)."));
  add_parameters(&options->strategy, all_values<Renewal>(), &list);
  add_parameters(&options->odometry, &list);

  OdometryErrorOptions& errors = options->odometry_errors;
  list.push_back(boolean_parameter("odometry_errors/estimate", &errors.estimate,
                                   "Estimate the systematic errors of the odometry: scales of "
                                   "distance and turn, drift, yaw-rate bias, delay."));

  LandmarkSensorOptions& sensor = options->sensor;
  list.push_back(
      basic(real_above_parameter("sensor/range_sigma", &sensor.range_sigma, 0.0, 1000.0, "m",
                                 "Standard deviation of a range, if the message gives none.")));
  list.push_back(real_parameter("sensor/range_sigma_share", &sensor.range_sigma_share, 0.0, 1.0, "",
                                "Added to that standard deviation, as a share of the range."));
  list.push_back(
      basic(real_above_parameter("sensor/bearing_sigma", &sensor.bearing_sigma, 0.0, 3.2, "rad",
                                 "Standard deviation of a bearing, if the message gives none.")));
  list.push_back(real_parameter("sensor/range_scale_sigma", &sensor.range_scale_sigma, 0.0, 1.0, "",
                                "Prior standard deviation of a scale error common to all ranges, "
                                "which redraw estimates. 0: none."));
  list.push_back(real_parameter("sensor/bearing_bias_sigma", &sensor.bearing_bias_sigma, 0.0, 3.2,
                                "rad",
                                "Prior standard deviation of an offset common to all bearings, "
                                "which redraw estimates. 0: none."));
  list.push_back(real_parameter("sensor/maximum_range", &sensor.maximum_range, 0.0, 1e6, "m",
                                "Maximum range of the sensor; 0: as far as it is found to see."));
  list.push_back(real_parameter(
      "sensor/field_of_view", &sensor.field_of_view, 0.0, 6.3, "rad",
      "Field of view about the x axis of the sensor; 0: as wide as it is found to see."));

  DataAssociationOptions& association = options->association;
  list.push_back(
      basic(choice_parameter("association/method", &association.method,
                             "Data association. automatic: known if the first observations carry "
                             "ids, otherwise mutual_exclusion.")));
  list.push_back(real_above_parameter("association/gate", &association.gate, 0.0, 1e6, "",
                                      "Validation gate: an observation with a larger squared "
                                      "Mahalanobis distance from its landmark is not used."));
  list.push_back(real_above_parameter(
      "association/new_landmark_gate", &association.new_landmark_gate, 0.0, 1e6, "",
      "An observation without id whose squared Mahalanobis distance from every landmark is larger "
      "starts a new landmark."));
  list.push_back(
      real_parameter("association/missed_log_odds", &association.missed_log_odds, 0.0, 100.0, "",
                     "Subtracted from the log-odds of a landmark that should have been seen but "
                     "was not (with ids: and that was seen once), or whose id is seen elsewhere. 0 "
                     "keeps all landmarks."));
  list.push_back(
      basic(boolean_parameter("map/frozen", &options->map.frozen,
                              "Localize only: landmarks are neither moved, added nor removed.")));
  list.push_back(basic(boolean_parameter("recovery/enabled", &options->recovery.enabled,
                                         "When the robot is lost, relocalize it where most of the "
                                         "observed landmarks with ids fit the map.")));
  return list;
}

double range_variance(const LandmarkSensorOptions& model, const RangeBearingObservation& z) {
  const double sigma = model.range_sigma + model.range_sigma_share * z.range;
  return z.range_variance > 0.0 ? z.range_variance : sigma * sigma;
}

double bearing_variance(const LandmarkSensorOptions& model, const RangeBearingObservation& z) {
  return z.bearing_variance > 0.0 ? z.bearing_variance : model.bearing_sigma * model.bearing_sigma;
}

void check_map_size(std::size_t landmarks, Eigen::Index particles, const MapOptions& limits) {
  const std::string what = std::to_string(landmarks) + " landmarks";
  if (landmarks > static_cast<std::size_t>(limits.max_landmarks)) {
    throw Error("a map of " + what + " is larger than the limit of " +
                std::to_string(limits.max_landmarks) + "; take out landmarks that you do not need");
  }
  const std::size_t estimates = landmarks * static_cast<std::size_t>(particles);
  if (estimates > static_cast<std::size_t>(limits.max_estimates)) {
    throw Error(what + " in " + std::to_string(particles) + " particles are " +
                std::to_string(estimates) + " estimates, more than the limit of " +
                std::to_string(limits.max_estimates) + "; take fewer particles");
  }
}

void validate(const FastSlamOptions& options) {
  FastSlamOptions copy = options;
  check_values(parameters_of(&copy));
  if (options.association.new_landmark_gate < options.association.gate) {
    throw Error("parameter association/new_landmark_gate is " +
                std::to_string(options.association.new_landmark_gate) +
                ", has to be at least association/gate, which is " +
                std::to_string(options.association.gate));
  }
  const Strategy strategy(options.strategy);
}

}  // namespace pf_resampling
