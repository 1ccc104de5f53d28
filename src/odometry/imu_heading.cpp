#include "src/odometry/imu_heading.hpp"

#include <cmath>
#include <utility>

#include "pf_resampling_core/geometry.hpp"
#include "src/messages/conversions.hpp"
#include "src/odometry/input_checks.hpp"

namespace pf_resampling {
namespace {

// An IMU that was silent for so long, or odometry that is so far from its newest message, is no
// measure of how the robot turned.
constexpr double kImuSilence = 0.2;  // s
// No robot turns faster.
constexpr double kLargestRate = 100.0;  // rad/s

double yaw_of(const Eigen::Matrix3d& turn) {
  return std::atan2(turn(1, 0), turn(0, 0));
}

}  // namespace

std::optional<Rejection> ImuHeading::take(const sensor_msgs::Imu& imu, const std::string& base,
                                          const StaticFrames& on_robot) {
  if (use_ == ImuUse::none) return std::nullopt;
  const bool has_orientation = imu.orientation_covariance[0] != -1.0;
  const bool has_rate = imu.angular_velocity_covariance[0] != -1.0;
  if (use_ == ImuUse::orientation ? !has_orientation : !has_rate) return std::nullopt;
  const ros::Time stamp = imu.header.stamp;
  if (auto wrong = check(stamp)) return wrong;
  const auto& w = imu.angular_velocity;
  const auto& q = imu.orientation;
  if (has_rate && !std::isfinite(w.x + w.y + w.z)) {
    return rejection(RejectReason::not_finite, "the angular velocity has a NaN or infinity");
  }
  if (use_ == ImuUse::orientation && !is_unit(q)) {
    return rejection(RejectReason::not_unit_quaternion, "orientation (", q.x, ", ", q.y, ", ", q.z,
                     ", ", q.w, ") is not of length 1");
  }
  const std::string frame = without_slash(imu.header.frame_id);
  Eigen::Matrix3d on_base = Eigen::Matrix3d::Identity();
  if (frame != without_slash(base)) {
    const auto pose = on_robot.pose(base, frame);
    if (!pose) {
      return rejection(RejectReason::unknown_frame, "where '", frame, "' is on '", base,
                       "' is not known: give it on /tf_static, or in the list `sensors` of the "
                       "configuration");
    }
    on_base = pose->linear();
  }
  const double silence = newest_.isZero() ? 2.0 * kImuSilence : (stamp - newest_).toSec();
  if (silence <= 0.0 && silence > -1.0) {
    return rejection(RejectReason::out_of_order, seconds_text(silence), " after the newest");
  }
  const double rate = has_rate ? (on_base * Eigen::Vector3d(w.x, w.y, w.z)).z() : 0.0;
  if (std::abs(rate) > kLargestRate) {
    return rejection(RejectReason::impossible_range, "it turns at ", rate, " rad/s");
  }
  if (use_ == ImuUse::orientation) {
    const Eigen::Quaterniond turn(q.w, q.x, q.y, q.z);
    heading_ = yaw_of(turn.normalized().toRotationMatrix() * on_base.transpose());
  } else if (silence > 0.0 && silence <= kImuSilence) {
    heading_ = wrap_angle(heading_ + 0.5 * (rate_ + rate) * silence);
  } else {
    was_silent_ = true;
  }
  rate_ = rate;
  newest_ = stamp;
  return std::nullopt;
}

std::optional<double> ImuHeading::at(ros::Time stamp) {
  if (use_ == ImuUse::none || newest_.isZero()) return std::nullopt;
  const double ahead = (stamp - newest_).toSec();
  if (std::abs(ahead) > kImuSilence) return std::nullopt;
  if (std::exchange(was_silent_, false)) return std::nullopt;
  return heading_ + rate_ * ahead;
}

}  // namespace pf_resampling
