#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "pf_resampling_core/filters/fastslam/odometry_errors.hpp"
#include "pf_resampling_core/models/landmark_observation.hpp"
#include "pf_resampling_core/models/odometry_motion.hpp"
#include "pf_resampling_core/parameters/parameters.hpp"
#include "pf_resampling_core/strategy/strategy.hpp"

namespace pf_resampling {

/// What the poses are drawn from (Kwak section 2).
enum class FastSlamVersion {
  fastslam_1,  ///< the odometry
  fastslam_2,  ///< the odometry and the observations
};
const EnumNames<FastSlamVersion>& names_of(FastSlamVersion);

/// Which landmark an observation is of.
enum class DataAssociation {
  automatic,           ///< known if the first observations carry ids, else mutual_exclusion
  known,               ///< the observations carry ids
  maximum_likelihood,  ///< the likeliest one, in each particle by itself
  mutual_exclusion,    ///< likewise, but no landmark takes two observations of a scan
};
const EnumNames<DataAssociation>& names_of(DataAssociation);

/// Noise of a landmark sensor, and what it can see. The defaults suit a camera that tells distances
/// by size as well as a laser scanner; they are rather wide, as too narrow ones cost the population
/// its diversity. Kwak section 4: 0.1 m, 1 degree, no share.
struct LandmarkSensorOptions {
  double range_sigma = 0.1;         ///< m, where the message has no variance
  double range_sigma_share = 0.02;  ///< of the range, added to it
  double bearing_sigma = 0.03;      ///< rad, where the message has no variance
  /// Errors that stay the same for long, standard deviations of their priors; estimated by a
  /// redraw alone. 0: free of it.
  double range_scale_sigma = 0.0;   ///< of measured over true range, less one
  double bearing_bias_sigma = 0.0;  ///< rad, measured less true bearing
  double maximum_range = 0.0;       ///< m; 0: as far as it is found to see
  double field_of_view = 0.0;       ///< rad, about its x axis; 0: as wide as it is found to see
};

/// m^2 and rad^2, of an observation: its own where it has one, else the model's.
double range_variance(const LandmarkSensorOptions& model, const RangeBearingObservation& z);
double bearing_variance(const LandmarkSensorOptions& model, const RangeBearingObservation& z);

struct DataAssociationOptions {
  DataAssociation method = DataAssociation::automatic;
  double gate = 13.8;  ///< squared Mahalanobis distance, two degrees of freedom: 99.9 % lie within
  /// Beyond this from every landmark, an unknown observation is a new one. Wide: particles know
  /// where they are worse than they believe, above all after a while without landmarks (Bailey,
  /// Nieto, Nebot 2006), and a landmark started twice bends the map.
  double new_landmark_gate = 64.0;
  double new_landmark_share = 0.05;  ///< of the observations, of landmarks not seen before
  static constexpr double seen_log_odds = 0.9;  ///< added to a landmark's existence when it is seen
  double missed_log_odds = 0.4;                 ///< taken off when it should have been seen
  static constexpr double removal_log_odds = -1.5;  ///< a landmark below this is removed
  /// What a landmark that was often seen is trusted with: it is gone after 19 misses.
  static constexpr double largest_log_odds = 6.0;
  /// Without ids: observations times landmarks near each, times particles, that a scan may have;
  /// each takes 32 bytes while the scan is used.
  int max_pairs = 20000000;
};

struct MapOptions {
  /// Landmarks are neither moved nor added nor removed: localization in the map as it is. Can be
  /// switched at any time.
  bool frozen = false;
  /// What is beyond is not taken into the map; a map or a number of particles that goes beyond is
  /// refused. Landmarks times particles: each takes 49 bytes.
  int max_landmarks = 20000;
  int max_estimates = 50000000;
};

/// Recovery of a robot that was carried away, by the landmarks with ids that it sees.
struct LandmarkRecoveryOptions {
  bool enabled = true;
};

/// Everything FastSlam can be told, with the only defaults there are. Names, units and ranges:
/// parameters_of().
struct FastSlamOptions {
  int particles = 1000;
  FastSlamVersion version = FastSlamVersion::fastslam_2;
  StrategyOptions strategy;
  OdometryNoise odometry;
  OdometryErrorOptions odometry_errors;
  LandmarkSensorOptions sensor;
  DataAssociationOptions association;
  MapOptions map;
  LandmarkRecoveryOptions recovery;

  FastSlamOptions();
};

ParameterList parameters_of(FastSlamOptions* options);

/// Throws Error naming the first parameter, or combination, that makes no sense.
void validate(const FastSlamOptions& options);

/// Throws Error that names value and limit for a map that is larger than the limits allow.
void check_map_size(std::size_t landmarks, Eigen::Index particles, const MapOptions& limits);

}  // namespace pf_resampling
