#include "pf_resampling_core/filters/beacon_mcl/checks.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling::checks {
namespace {

constexpr double kFarthest = 1e12;          // m
constexpr double kLargestTurn = 1e4;        // rad
constexpr double kSmallestVariance = 1e-9;  // m^2
constexpr double kLargestVariance = 1e9;    // m^2

// False for NaN too.
bool is_within(double value, double bound) {
  return std::abs(value) <= bound;
}

bool is_covariance(const Eigen::Matrix3d& covariance) {
  return covariance.allFinite() && (covariance.diagonal().array() >= 0.0).all();
}

bool is_variance_or_zero(double variance) {
  return variance == 0.0 || (variance >= kSmallestVariance && variance <= kLargestVariance);
}

std::string text(double value) {
  return std::to_string(value);
}

}  // namespace

void check_range(const RangeObservation& range) {
  const bool is_usable =
      range.range > 0.0 && range.range <= kFarthest && is_variance_or_zero(range.variance);
  if (!is_usable) {
    throw Error("range " + text(range.range) + " m with variance " + text(range.variance) +
                " m^2 of beacon " + std::to_string(range.beacon) +
                " cannot be used: it has to be in (0, 1e12] m, its variance 0 (the model's own) or "
                "in [1e-9, 1e9] m^2");
  }
  for (const double coordinate : range.antenna) {
    if (is_within(coordinate, kFarthest)) continue;
    throw Error("range of beacon " + std::to_string(range.beacon) +
                " cannot be used: the antenna's position on the robot has the coordinate " +
                text(coordinate) + " m, has to be in [-1e12, 1e12] m");
  }
}

void check_odometry(const OdometryIncrement& odometry) {
  const bool is_usable =
      odometry.duration >= 0.0 && is_within(odometry.duration, 1e9) &&
      is_within(odometry.mean.x, kFarthest) && is_within(odometry.mean.y, kFarthest) &&
      is_within(odometry.mean.heading, kLargestTurn) && is_covariance(odometry.covariance) &&
      is_covariance(odometry.slip_covariance) && odometry.yaw_rate_sensitivity.allFinite();
  if (is_usable) return;
  throw Error("odometry (" + text(odometry.mean.x) + " m, " + text(odometry.mean.y) + " m, " +
              text(odometry.mean.heading) + " rad) over " + text(odometry.duration) +
              " s cannot be used: it has to be finite, with a duration and variances that are not "
              "negative");
}

void check_pose(const Pose2& mean, const Eigen::Matrix3d& covariance) {
  const bool is_usable = is_within(mean.x, kFarthest) && is_within(mean.y, kFarthest) &&
                         is_within(mean.heading, kLargestTurn) && is_covariance(covariance);
  if (is_usable) return;
  throw Error("pose (" + text(mean.x) + " m, " + text(mean.y) + " m, " + text(mean.heading) +
              " rad) cannot be started from: it has to be finite and within 1e12 m, with variances "
              "that are not "
              "negative");
}

void check_beacons(const std::vector<Beacon>& beacons, std::size_t fewest) {
  if (beacons.size() < fewest) {
    throw Error("no beacons are known; give at least one and its position");
  }
  std::set<int> ids;
  for (const Beacon& beacon : beacons) {
    if (!ids.insert(beacon.id).second) {
      throw Error("beacon " + std::to_string(beacon.id) +
                  " appears twice; give every beacon an id of its own");
    }
    for (const double coordinate : beacon.position) {
      if (is_within(coordinate, kFarthest)) continue;
      throw Error("the position of beacon " + std::to_string(beacon.id) + " has the coordinate " +
                  text(coordinate) + " m, has to be in [-1e12, 1e12] m");
    }
    if (!(beacon.sigma >= 0.0) || !is_within(beacon.sigma, kFarthest)) {
      throw Error("the sigma of beacon " + std::to_string(beacon.id) + " is " + text(beacon.sigma) +
                  " m, has to be in [0, 1e12] m");
    }
  }
}

void check_calibration(const RangeCalibrations& calibration) {
  for (const auto& [beacon, given] : calibration) {
    const bool is_usable = given.scale > 0.0 && is_within(given.scale, 1e3) &&
                           is_within(given.bias, kFarthest) &&
                           is_variance_or_zero(given.sigma * given.sigma) && given.sigma >= 0.0;
    if (is_usable) continue;
    throw Error("the calibration of beacon " + std::to_string(beacon) + " (scale " +
                text(given.scale) + ", bias " + text(given.bias) + " m, sigma " +
                text(given.sigma) +
                " m) makes no sense: the scale has to be in (0, 1000], bias and sigma finite, "
                "sigma not negative");
  }
}

}  // namespace pf_resampling::checks
