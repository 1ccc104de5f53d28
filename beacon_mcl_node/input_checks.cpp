#include "beacon_mcl_node/input_checks.hpp"

#include <cmath>
#include <set>
#include <sstream>

#include "pf_resampling/conversions.hpp"

namespace pf_resampling {
namespace {

template <typename... Parts>
Rejection reject(RejectReason reason, const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  return {reason, text.str()};
}

std::optional<Rejection> check_frame(const std::string& what, const std::string& given,
                                     const std::string& expected, const std::string& parameter) {
  if (without_slash(given) == without_slash(expected)) return std::nullopt;
  return reject(RejectReason::wrong_frame, what, " is '", given, "', expected '", expected,
                "' (parameter ", parameter, ")");
}

std::optional<Rejection> check_pose(const geometry_msgs::Pose& pose) {
  if (!is_finite(pose)) return reject(RejectReason::not_finite, "the pose has a NaN or infinity");
  if (!is_unit(pose.orientation)) {
    const auto& q = pose.orientation;
    return reject(RejectReason::not_unit_quaternion, "orientation (", q.x, ", ", q.y, ", ", q.z,
                  ", ", q.w, ") is not of length 1");
  }
  return std::nullopt;
}

std::optional<Rejection> check_covariance(const boost::array<double, 36>& covariance) {
  const Eigen::Matrix3d planar = to_covariance3(covariance);
  if (!planar.allFinite()) {
    return reject(RejectReason::not_finite, "the covariance has a NaN or infinity");
  }
  if (!is_covariance(planar)) {
    return reject(RejectReason::impossible_variance,
                  "the covariance is not symmetric, or negative "
                  "in some direction");
  }
  return std::nullopt;
}

}  // namespace

std::optional<Rejection> check(const nav_msgs::Odometry& odometry,
                               const BeaconMclPipelineOptions& options) {
  if (odometry.header.stamp.isZero()) return reject(RejectReason::no_stamp, "the stamp is zero");
  if (auto wrong = check_frame("header.frame_id", odometry.header.frame_id, options.odom_frame,
                               "frames/odom")) {
    return wrong;
  }
  if (auto wrong = check_frame("child_frame_id", odometry.child_frame_id, options.base_frame,
                               "frames/base")) {
    return wrong;
  }
  if (auto wrong = check_pose(odometry.pose.pose)) return wrong;
  return check_covariance(odometry.pose.covariance);
}

std::optional<Rejection> check(const BeaconRange& range) {
  if (range.header.stamp.isZero()) return reject(RejectReason::no_stamp, "the stamp is zero");
  if (!std::isfinite(range.range)) {
    return reject(RejectReason::not_finite, "the range to beacon ", range.beacon, " is ",
                  range.range);
  }
  if (range.range <= 0.0) {
    return reject(RejectReason::not_positive, "the range to beacon ", range.beacon, " is ",
                  range.range, " m");
  }
  if (!std::isfinite(range.variance)) {
    return reject(RejectReason::not_finite, "the variance of the range to beacon ", range.beacon,
                  " is ", range.variance);
  }
  if (range.variance < 0.0) {
    return reject(RejectReason::impossible_variance, "the variance of the range to beacon ",
                  range.beacon, " is ", range.variance, " m^2");
  }
  return std::nullopt;
}

std::optional<Rejection> check(const BeaconArray& array, const BeaconMclPipelineOptions& options) {
  if (auto wrong =
          check_frame("header.frame_id", array.header.frame_id, options.map_frame, "frames/map")) {
    return wrong;
  }
  if (array.beacons.empty()) return reject(RejectReason::empty, "there is no beacon in it");
  std::set<int> ids;
  for (const auto& beacon : array.beacons) {
    if (!std::isfinite(beacon.position.x) || !std::isfinite(beacon.position.y) ||
        std::isinf(beacon.position.z)) {
      return reject(RejectReason::not_finite, "the position of beacon ", beacon.id,
                    " has a NaN or infinity");
    }
    if (!ids.insert(beacon.id).second) {
      return reject(RejectReason::duplicate_beacon, "beacon ", beacon.id, " is there twice");
    }
  }
  return std::nullopt;
}

std::optional<Rejection> check(const geometry_msgs::PoseWithCovarianceStamped& pose,
                               const BeaconMclPipelineOptions& options) {
  if (auto wrong =
          check_frame("header.frame_id", pose.header.frame_id, options.map_frame, "frames/map")) {
    return wrong;
  }
  if (auto wrong = check_pose(pose.pose.pose)) return wrong;
  return check_covariance(pose.pose.covariance);
}

StampedOdometry to_stamped_odometry(const nav_msgs::Odometry& odometry) {
  StampedOdometry stamped;
  stamped.stamp = odometry.header.stamp;
  stamped.pose = to_pose2(odometry.pose.pose);
  const Eigen::Matrix3d covariance = to_covariance3(odometry.pose.covariance);
  if (covariance.diagonal().minCoeff() > 0.0) stamped.covariance = covariance;
  return stamped;
}

std::vector<Beacon> to_beacons(const BeaconArray& array) {
  std::vector<Beacon> beacons;
  for (const auto& message : array.beacons) {
    Beacon beacon;
    beacon.id = message.id;
    beacon.is_planar = std::isnan(message.position.z);
    beacon.position = {message.position.x, message.position.y,
                       beacon.is_planar ? 0.0 : message.position.z};
    beacons.push_back(beacon);
  }
  return beacons;
}

}  // namespace pf_resampling
