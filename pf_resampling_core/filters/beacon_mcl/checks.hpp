#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "pf_resampling_core/filters/beacon_mcl/options.hpp"
#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/models/beacon_range.hpp"
#include "pf_resampling_core/models/odometry_motion.hpp"

/// What beacon_mcl.cpp can use and what not; all throw Error with one line. The bounds lie far
/// outside of anything on Earth's surface, and far inside of what the squares of numbers can hold.
namespace pf_resampling::checks {

void check_range(const RangeObservation& range);
void check_odometry(const OdometryIncrement& odometry);
void check_pose(const Pose2& mean, const Eigen::Matrix3d& covariance);

/// At least so many, ids all different, positions finite.
void check_beacons(const std::vector<Beacon>& beacons, std::size_t fewest = 1);
void check_calibration(const std::vector<std::pair<int, RangeCalibration>>& calibration);

/// Radios whose errors each particle holds.
Eigen::Index radios_of(CalibrationEstimation estimation, std::size_t beacons);

/// These estimates have to fit into memory: 50 million, of 40 bytes, at most.
void check_estimates(CalibrationEstimation estimation, std::size_t beacons, Eigen::Index particles);
/// Likewise, of as many particles as the options allow.
void check_estimates(const BeaconMclOptions& options, std::size_t beacons);

}  // namespace pf_resampling::checks
