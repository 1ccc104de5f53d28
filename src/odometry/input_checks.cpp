#include "src/odometry/input_checks.hpp"

#include <cmath>
#include <cstdio>

#include "src/messages/conversions.hpp"

namespace pf_resampling {

namespace {

// With more than this, m^2 or rad^2, nothing is known: no belief is worth being spread so far.
constexpr double kLargestVariance = 1e12;

std::optional<Rejection> check_pose(const geometry_msgs::Pose& pose) {
  if (!is_finite(pose))
    return rejection(RejectReason::not_finite, "the pose has a NaN or infinity");
  if (!is_unit(pose.orientation)) {
    const auto& q = pose.orientation;
    return rejection(RejectReason::not_unit_quaternion, "orientation (", q.x, ", ", q.y, ", ", q.z,
                     ", ", q.w, ") is not of length 1");
  }
  const auto& p = pose.position;
  if (std::abs(p.x) > kFarthestPosition || std::abs(p.y) > kFarthestPosition) {
    return rejection(RejectReason::impossible_position, "the position (", p.x, " m, ", p.y,
                     " m) is farther than ", kFarthestPosition, " m from the origin");
  }
  return std::nullopt;
}

std::optional<Rejection> check_covariance(const boost::array<double, 36>& covariance) {
  const Eigen::Matrix3d planar = to_covariance3(covariance);
  if (!planar.allFinite()) {
    return rejection(RejectReason::not_finite, "the covariance has a NaN or infinity");
  }
  if (!is_covariance(planar)) {
    return rejection(RejectReason::impossible_variance,
                     "the covariance is not symmetric or not positive semidefinite");
  }
  if (planar.diagonal().maxCoeff() > kLargestVariance) {
    return rejection(RejectReason::impossible_variance, "the covariance has a variance of ",
                     planar.diagonal().maxCoeff(), ", more than ", kLargestVariance);
  }
  return std::nullopt;
}

}  // namespace

std::optional<Rejection> check_frame(const std::string& what, const std::string& given,
                                     const std::string& expected, const std::string& parameter) {
  if (without_slash(given) == without_slash(expected)) return std::nullopt;
  return rejection(RejectReason::wrong_frame, what, " is '", given, "', expected '", expected,
                   "' (parameter ", parameter, ")");
}

std::optional<Rejection> check(const ros::Time& stamp) {
  if (stamp.isZero()) return rejection(RejectReason::no_stamp, "the stamp is zero");
  // Differences of stamps are of 32 bits with sign; ROS throws at larger ones.
  if (stamp.sec > 0x7fffffffU) {
    return rejection(RejectReason::impossible_stamp, "the stamp is ", stamp.sec,
                     " s, which is too large for ROS 1");
  }
  if (stamp.nsec >= 1000000000U) {
    return rejection(RejectReason::impossible_stamp, "the stamp has ", stamp.nsec,
                     " nanoseconds, which is a second or more");
  }
  return std::nullopt;
}

std::optional<Rejection> check(const nav_msgs::Odometry& odometry, const FrameNames& frames) {
  if (auto wrong = check(odometry.header.stamp)) return wrong;
  if (auto wrong =
          check_frame("header.frame_id", odometry.header.frame_id, frames.odom, "frames/odom")) {
    return wrong;
  }
  // Many drivers leave it out: it is the robot's.
  if (!odometry.child_frame_id.empty()) {
    if (auto wrong =
            check_frame("child_frame_id", odometry.child_frame_id, frames.base, "frames/base")) {
      return wrong;
    }
  }
  if (auto wrong = check_pose(odometry.pose.pose)) return wrong;
  return check_covariance(odometry.pose.covariance);
}

std::optional<Rejection> check(const geometry_msgs::PoseWithCovarianceStamped& pose,
                               const FrameNames& frames) {
  if (auto wrong = check_frame("header.frame_id", pose.header.frame_id, frames.map, "frames/map")) {
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
  const auto& of_twist = odometry.twist.covariance;
  stamped.velocity_variances = {of_twist[0], of_twist[7], of_twist[35]};
  return stamped;
}

std::string seconds_text(double seconds) {
  char text[40];
  std::snprintf(text, sizeof(text), "%.3f s", seconds);
  return text;
}

}  // namespace pf_resampling
