#include "src/odometry/dead_reckoning.hpp"

#include <cmath>

#include "src/odometry/input_checks.hpp"

namespace pf_resampling {
namespace {

// Share of the time gone by, from its begin, within which time that jumps back begins again.
constexpr double kBegin = 0.1;

}  // namespace

DeadReckoning::Taken DeadReckoning::take(const nav_msgs::Odometry& message,
                                         const OdometryNoise& noise,
                                         std::optional<double> heading) {
  StampedOdometry odometry = to_stamped_odometry(message);
  odometry.heading = heading;
  const bool first = buffer_.empty();
  const ros::Time before = first ? ros::Time() : buffer_.newest();
  const OdometryBuffer::Addition addition = buffer_.add(odometry, used_);
  const std::string step = first ? "" : seconds_text((odometry.stamp - before).toSec());
  const auto rejected = [](RejectReason reason, const std::string& detail) {
    Taken taken;
    taken.rejection = Rejection{reason, detail};
    return taken;
  };
  Taken taken;
  switch (addition) {
    case OdometryBuffer::Addition::added:
      break;
    case OdometryBuffer::Addition::out_of_order:
      return rejected(RejectReason::out_of_order, step + " after the newest");
    case OdometryBuffer::Addition::time_jump:
      return rejected(RejectReason::time_jump, step + " after the newest");
    case OdometryBuffer::Addition::time_gap:
      return rejected(RejectReason::time_gap, step + " after the newest");
    case OdometryBuffer::Addition::pose_jump:
      return rejected(RejectReason::pose_jump,
                      "it is farther from the one before than the robot's motion so far and the "
                      "limits of speed and turn rate allow");
    case OdometryBuffer::Addition::time_jumped: {
      const double forward = (buffer_.oldest() - before).toSec();
      if (forward < 0.0) ++time_jumps_;
      taken.time_jumped = true;
      taken.warning = std::string("time jumped ") + (forward < 0.0 ? "back" : "forward") + " by " +
                      seconds_text(std::abs(forward)) + ": buffers are reset";
      taken.began_again = (buffer_.oldest() - began_).toSec() <= kBegin * (before - began_).toSec();
      taken.until_jump = since_;
      first_ = ros::Time();
      if (taken.began_again || forward > 0.0) began_ = ros::Time();
      break;
    }
    case OdometryBuffer::Addition::gap_closed:
      taken.warning = "no odometry for " + step;
      break;
    case OdometryBuffer::Addition::pose_jumped:
      ++pose_jumps_;
      taken.warning = "the odometry jumped; the jump is not taken for motion";
      break;
  }
  if (first_.isZero()) {
    first_ = buffer_.oldest();
    if (began_.isZero()) began_ = first_;
    restart_at_oldest(noise);
  } else {
    buffer_.extend(before, buffer_.newest(), noise, &since_);
  }
  return taken;
}

void DeadReckoning::clear() {
  buffer_.clear();
  first_ = began_ = ros::Time();
  used_ = ros::Time();
  since_ = OdometryIncrement{};
}

std::optional<Rejection> DeadReckoning::check_stamp(ros::Time stamp, double tolerance) const {
  if (stamp < first_) {
    return Rejection{RejectReason::before_odometry,
                     seconds_text((first_ - stamp).toSec()) + " before the first odometry"};
  }
  if (stamp + ros::Duration(tolerance) < used_) {
    return Rejection{RejectReason::old,
                     seconds_text((used_ - stamp).toSec()) +
                         " older than the observations that the filter has used"};
  }
  return std::nullopt;
}

std::optional<Rejection> DeadReckoning::check_ahead(ros::Time stamp, double limit) const {
  if (buffer_.empty()) return std::nullopt;
  const double ahead = (stamp - buffer_.newest()).toSec();
  if (ahead <= limit) return std::nullopt;
  return Rejection{RejectReason::ahead_of_odometry,
                   seconds_text(ahead) + " newer than the newest odometry"};
}

OdometryIncrement DeadReckoning::until(ros::Time stamp, const OdometryNoise& noise) const {
  return buffer_.integrate(used_, stamp, noise);
}

void DeadReckoning::use_until(ros::Time stamp, const OdometryNoise& noise) {
  used_ = stamp;
  since_ = buffer_.integrate(used_, buffer_.newest(), noise);
}

void DeadReckoning::restart_at_oldest(const OdometryNoise& noise) {
  if (!buffer_.empty()) use_until(buffer_.oldest(), noise);
}

void DeadReckoning::restart_at(ros::Time stamp, const OdometryNoise& noise) {
  if (!buffer_.empty()) use_until(buffer_.covers(stamp) ? stamp : buffer_.newest(), noise);
}

void DeadReckoning::save(SavedProgress* progress) const {
  progress->first_odometry = first_;
  progress->used = used_;
  buffer_.save(used_, progress);
}

void DeadReckoning::resume(const SavedProgress& progress, const OdometryNoise& noise) {
  buffer_.resume(progress);
  first_ = began_ = progress.first_odometry;
  use_until(progress.used, noise);
}

std::optional<ros::Time> DeadReckoning::overdue() const {
  if (buffer_.empty()) return std::nullopt;
  if (buffer_.is_full() && used_ < buffer_.middle()) return buffer_.middle();
  if ((buffer_.newest() - used_).toSec() < 0.5 * length_) return std::nullopt;
  return buffer_.newest() - ros::Duration(0.25 * length_);
}

PoseEstimate moved_by(const PoseEstimate& estimate, const OdometryIncrement& motion) {
  PoseEstimate moved;
  moved.mean = compose(estimate.mean, motion.mean);
  Eigen::Matrix3d by_start = Eigen::Matrix3d::Identity();
  by_start(0, 2) = -(moved.mean.y - estimate.mean.y);
  by_start(1, 2) = moved.mean.x - estimate.mean.x;
  const Eigen::Matrix3d to_map = by_second(estimate.mean);
  moved.covariance = by_start * estimate.covariance * by_start.transpose() +
                     to_map * motion.covariance * to_map.transpose();
  return moved;
}

// Dead reckoning turns by its bias too much.
OdometryIncrement without_yaw_rate_bias(const OdometryIncrement& motion, double bias,
                                        double sigma) {
  const Eigen::Vector3d& sensitivity = motion.yaw_rate_sensitivity;
  OdometryIncrement corrected = motion;
  corrected.mean = {motion.mean.x - sensitivity[0] * bias, motion.mean.y - sensitivity[1] * bias,
                    motion.mean.heading - sensitivity[2] * bias};
  corrected.covariance += sigma * sigma * sensitivity * sensitivity.transpose();
  return corrected;
}

}  // namespace pf_resampling
