#include "pf_resampling_core/filters/fastslam/options.hpp"

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/parameters/enum_names.hpp"

namespace pf_resampling {
namespace {

const EnumNames<FastSlamVersion> kVersions{
    "FastSLAM version",
    {{FastSlamVersion::fastslam_1, "fastslam_1"}, {FastSlamVersion::fastslam_2, "fastslam_2"}}};
const EnumNames<DataAssociation> kAssociations{
    "data association",
    {{DataAssociation::automatic, "automatic"},
     {DataAssociation::known, "known"},
     {DataAssociation::maximum_likelihood, "maximum_likelihood"},
     {DataAssociation::mutual_exclusion, "mutual_exclusion"}}};

}  // namespace

const std::vector<FastSlamVersion>& all_fastslam_versions() {
  return kVersions.values();
}
std::string to_string(FastSlamVersion version) {
  return kVersions.name(version);
}
const std::vector<DataAssociation>& all_data_associations() {
  return kAssociations.values();
}
std::string to_string(DataAssociation association) {
  return kAssociations.name(association);
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
  list.push_back(
      integer_parameter("particles", &options->particles, 1, 1000000, "Number of particles."));
  list.push_back(choice_parameter(
      "version", &options->version, all_fastslam_versions(),
      "What poses are drawn from: the odometry (1.0), or it and the observations (2.0)."));
  add_parameters(&options->strategy, &list);
  add_parameters(&options->odometry, &list);

  OdometryErrorOptions& errors = options->odometry_errors;
  list.push_back(boolean_parameter("odometry_errors/estimate", &errors.estimate,
                                   "Estimate errors of the odometry that stay the same for long; "
                                   "the following are the prior's standard deviations."));
  list.push_back(real_parameter("odometry_errors/distance_scale", &errors.distance_scale, 0.0, 1.0,
                                "", "Relative error of distances."));
  list.push_back(real_parameter("odometry_errors/turn_scale", &errors.turn_scale, 0.0, 1.0, "",
                                "Relative error of turns."));
  list.push_back(real_parameter("odometry_errors/drift", &errors.drift, 0.0, 10.0, "rad/m",
                                "Turn per distance that is not in the odometry."));
  list.push_back(real_parameter("odometry_errors/yaw_rate", &errors.yaw_rate, 0.0, 10.0, "rad/s",
                                "Turn per time that is not in the odometry."));
  list.push_back(real_parameter("odometry_errors/delay", &errors.delay, 0.0, 10.0, "s",
                                "Delay of the observations against the odometry, or of it."));
  list.push_back(real_parameter("odometry_errors/walk", &errors.walk, 0.0, 10.0, "1/sqrt(s)",
                                "Share of these by which the errors wander in a second."));

  LandmarkSensorOptions& sensor = options->sensor;
  list.push_back(real_above_parameter("sensor/range_sigma", &sensor.range_sigma, 0.0, 1000.0, "m",
                                      "Standard deviation of a range where the message has none."));
  list.push_back(real_parameter("sensor/range_sigma_share", &sensor.range_sigma_share, 0.0, 1.0, "",
                                "Share of the range that is added to it."));
  list.push_back(
      real_above_parameter("sensor/bearing_sigma", &sensor.bearing_sigma, 0.0, 3.2, "rad",
                           "Standard deviation of a bearing where the message has none."));
  list.push_back(real_parameter("sensor/maximum_range", &sensor.maximum_range, 0.0, 1e6, "m",
                                "How far landmarks are seen; 0: as far as one has been seen yet."));
  list.push_back(
      real_parameter("sensor/field_of_view", &sensor.field_of_view, 0.0, 6.3, "rad",
                     "How wide, about the sensor's x axis; 0: as wide as one has been seen yet."));

  DataAssociationOptions& association = options->association;
  list.push_back(choice_parameter(
      "association/method", &association.method, all_data_associations(),
      "Which landmark an observation is of; automatic: known if the first observations "
      "carry ids, else mutual_exclusion."));
  list.push_back(real_above_parameter(
      "association/gate", &association.gate, 0.0, 1e6, "",
      "Squared Mahalanobis distance beyond which an observation is not believed."));
  list.push_back(real_above_parameter(
      "association/new_landmark_gate", &association.new_landmark_gate, 0.0, 1e6, "",
      "Beyond this from every landmark an unknown observation is a new one."));
  list.push_back(real_above_parameter(
      "association/new_landmark_share", &association.new_landmark_share, 0.0, 1.0, "",
      "Share of unknown observations that is expected to be of landmarks not seen before."));
  list.push_back(
      real_parameter("association/seen_log_odds", &association.seen_log_odds, 0.0, 100.0, "",
                     "Added to the log-odds of a landmark's existence when it is seen."));
  list.push_back(real_parameter("association/missed_log_odds", &association.missed_log_odds, 0.0,
                                100.0, "",
                                "Taken off them when it should have been seen, or its id is seen "
                                "elsewhere; 0 keeps all landmarks."));
  list.push_back(real_parameter("association/removal_log_odds", &association.removal_log_odds,
                                -100.0, 0.0, "", "A landmark below this is removed."));
  list.push_back(real_parameter("association/largest_log_odds", &association.largest_log_odds, 0.0,
                                1000.0, "",
                                "What the log-odds of an often seen landmark are limited to."));
  list.push_back(boolean_parameter(
      "map/frozen", &options->map.frozen,
      "Landmarks are neither moved nor added nor removed: localization in the map as it is."));
  list.push_back(boolean_parameter(
      "recovery/enabled", &options->recovery.enabled,
      "Once the observations do not fit the belief, put the robot where most of the landmarks with "
      "ids that it sees fit the map."));
  return list;
}

double range_variance(const LandmarkSensorOptions& model, const RangeBearingObservation& z) {
  const double sigma = model.range_sigma + model.range_sigma_share * z.range;
  return z.range_variance > 0.0 ? z.range_variance : sigma * sigma;
}

double bearing_variance(const LandmarkSensorOptions& model, const RangeBearingObservation& z) {
  return z.bearing_variance > 0.0 ? z.bearing_variance : model.bearing_sigma * model.bearing_sigma;
}

void validate(const FastSlamOptions& options) {
  FastSlamOptions copy = options;
  for (const Parameter& parameter : parameters_of(&copy)) parameter.set_checked(parameter.get());
  if (options.association.new_landmark_gate < options.association.gate) {
    throw Error("parameter association/new_landmark_gate is " +
                std::to_string(options.association.new_landmark_gate) +
                ", has to be at least association/gate, which is " +
                std::to_string(options.association.gate));
  }
  const Strategy strategy(options.strategy);
}

}  // namespace pf_resampling
