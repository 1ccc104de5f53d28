#pragma once

#include <cstddef>
#include <utility>
#include <vector>

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
void check_calibration(const RangeCalibrations& calibration);

}  // namespace pf_resampling::checks
