#include "src/odometry/odometry_buffer.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

/// What a message may be off by whatever the time since the last: rounding, late stamps.
constexpr double kPositionSlack = 0.5;  // m
constexpr double kHeadingSlack = 0.5;   // rad
/// A velocity is that of so long, of at least so long, and of so many poses at most.
constexpr double kVelocitySpan = 0.3;   // s
constexpr double kShortestSpan = 0.05;  // s
constexpr std::size_t kVelocityPoses = 50;
/// A robot whose odometry starts again after longer may have done anything.
constexpr double kLongestJump = 2.0;  // s
/// After so long, it is the clock that was set, not the odometry that was silent.
constexpr double kLongestGap = 3600.0;  // s
/// Standard deviations after a second that an odometry may state, m/sqrt(s) and rad/sqrt(s).
constexpr double kLeastStatedNoise = 2e-4;
constexpr double kMostStatedNoise = 1.0;
/// What is stated is white noise; play and scrub of the wheels come on top. Taken as it is, drives
/// with slips were beyond three standard deviations and healthy for 3 % of the time; so, 0.7 %.
constexpr double kOfStatedNoise = 2.0;

/// The motion that takes `share` of the time of `motion`, at constant speed and turn rate: a piece
/// of the same arc.
Pose2 part_of(const Pose2& motion, double share) {
  const double turn = motion.heading;
  if (std::abs(turn) < 1e-6) return {share * motion.x, share * motion.y, share * turn};
  // Twist of the arc (SE(2) logarithm), then the motion along it (exponential).
  const double half_cotangent = 0.5 * turn / std::tan(0.5 * turn);
  const double vx = half_cotangent * motion.x + 0.5 * turn * motion.y;
  const double vy = -0.5 * turn * motion.x + half_cotangent * motion.y;
  const double a = std::sin(share * turn) / turn;
  const double b = (1.0 - std::cos(share * turn)) / turn;
  return {a * vx - b * vy, b * vx + a * vy, share * turn};
}

/// A motion of the same length that turns by `turn` instead: the chord of an arc lies half a turn
/// ahead of its start.
Pose2 turned_by(const Pose2& motion, double turn) {
  const double ahead = 0.5 * wrap_angle(turn - motion.heading);
  const double cosine = std::cos(ahead);
  const double sine = std::sin(ahead);
  return {cosine * motion.x - sine * motion.y, sine * motion.x + cosine * motion.y, turn};
}

std::string text_of(ros::Time stamp) {
  return std::to_string(stamp.toSec());
}

}  // namespace

const EnumNames<OdometrySource>& names_of(OdometrySource) {
  static const EnumNames<OdometrySource> names(
      "source of odometry", {{OdometrySource::topic, "topic"}, {OdometrySource::tf, "tf"}});
  return names;
}

const EnumNames<ImuUse>& names_of(ImuUse) {
  static const EnumNames<ImuUse> names("use of the IMU", {{ImuUse::none, "none"},
                                                          {ImuUse::yaw_rate, "yaw_rate"},
                                                          {ImuUse::orientation, "orientation"}});
  return names;
}

ParameterList parameters_of(OdometryBufferOptions* options) {
  return {
      basic(choice_parameter("odometry_input/source", &options->source,
                             "Source of odometry: the topic odom, or the transform frames/odom -> "
                             "frames/base on /tf.")),
      basic(choice_parameter(
          "odometry_input/imu_heading", &options->imu_heading,
          "Source of heading changes: the odometry (none), or yaw_rate or orientation of the topic "
          "imu. Where the IMU is silent, odometry is used.")),
      boolean_parameter(
          "odometry_input/use_covariance", &options->use_covariance,
          "Use the covariance of the odometry messages in place of the motion model's "
          "noise: of their poses, wherever it grows; fastslam: or else of their "
          "twists."),
  };
}

std::optional<Eigen::Matrix3d> covariance_growth(const Pose2& from, const Pose2& to,
                                                 const Eigen::Matrix3d& before,
                                                 const Eigen::Matrix3d& after) {
  Eigen::Matrix3d lever = Eigen::Matrix3d::Identity();
  lever(0, 2) = -(to.y - from.y);
  lever(1, 2) = to.x - from.x;
  Eigen::Matrix3d growth = after - lever * before * lever.transpose();
  const Eigen::Matrix3d to_body = by_second(from).transpose();
  growth = to_body * growth * to_body.transpose();
  growth = 0.5 * (growth + growth.transpose()).eval();

  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(growth);
  const Eigen::Vector3d& values = solver.eigenvalues();
  const double rounding = 1e-9 * (before.trace() + after.trace());
  if (!(values.maxCoeff() > rounding) || values.minCoeff() < -0.01 * values.maxCoeff() - rounding) {
    return std::nullopt;
  }
  return Eigen::Matrix3d(solver.eigenvectors() * values.cwiseMax(0.0).asDiagonal() *
                         solver.eigenvectors().transpose());
}

std::optional<Eigen::Matrix3d> covariance_of_step(const Eigen::Vector3d& velocity_variances,
                                                  double duration) {
  const Eigen::Array3d after_a_second = (duration * velocity_variances.array()).sqrt();
  const auto is_stated = [&](int axis) {
    return after_a_second[axis] >= kLeastStatedNoise && after_a_second[axis] <= kMostStatedNoise;
  };
  if (!is_stated(0) || !is_stated(2)) return std::nullopt;
  Eigen::Vector3d variances = velocity_variances;
  if (!is_stated(1)) variances[1] = kLeastStatedNoise * kLeastStatedNoise / duration;
  const double scale = kOfStatedNoise * duration;
  return Eigen::Matrix3d((scale * scale * variances).asDiagonal());
}

bool OdometryBuffer::continues(ros::Time stamp, const Pose2& pose,
                               const StampedOdometry& next) const {
  const double duration = (next.stamp - stamp).toSec();
  if (duration <= 0.0 || duration > options_.max_gap) return false;
  const double distance = std::hypot(next.pose.x - pose.x, next.pose.y - pose.y);
  const double turn = std::abs(wrap_angle(next.pose.heading - pose.heading));
  return distance <= options_.max_speed * duration + kPositionSlack &&
         turn <= options_.max_turn_rate * duration + kHeadingSlack;
}

std::optional<Velocity> OdometryBuffer::velocity() const {
  const OdometrySample& last = samples_.back();
  for (std::size_t back = 1; back < samples_.size(); ++back) {
    const OdometrySample& first = samples_[samples_.size() - 1 - back];
    const double span = (last.stamp - first.stamp).toSec();
    const bool is_last = back + 1 == samples_.size() || back == kVelocityPoses;
    if (span < kVelocitySpan && !is_last) continue;
    if (span < kShortestSpan) return std::nullopt;
    return velocity_of(relative(first.pose, last.pose), span);
  }
  return std::nullopt;
}

Velocity OdometryBuffer::velocity_of_suspects() const {
  const StampedOdometry& first = suspects_.front();
  const StampedOdometry& last = suspects_.back();
  if (suspects_.size() < 2) return velocity().value_or(Velocity());
  return velocity_of(relative(first.pose, last.pose), (last.stamp - first.stamp).toSec());
}

bool OdometryBuffer::continues_newest(const StampedOdometry& next) const {
  const OdometrySample& last = samples_.back();
  if (!continues(last.stamp, last.received, next)) return false;
  const std::optional<Velocity> before = velocity();
  return !before || learnt_.allows(relative(last.received, next.pose),
                                   (next.stamp - last.stamp).toSec(), *before);
}

bool OdometryBuffer::continues_suspects(const StampedOdometry& next) const {
  if (suspects_.empty() || suspicion_ != Addition::pose_jump) return false;
  const StampedOdometry& newest = suspects_.back();
  if (!continues(newest.stamp, newest.pose, next)) return false;
  const auto misfit = [&](ros::Time stamp, const Pose2& pose, const Velocity& velocity) {
    const Pose2 expected = compose(pose, motion_of(velocity, (next.stamp - stamp).toSec()));
    return std::hypot(next.pose.x - expected.x, next.pose.y - expected.y) +
           std::abs(wrap_angle(next.pose.heading - expected.heading));
  };
  const OdometrySample& last = samples_.back();
  return misfit(newest.stamp, newest.pose, velocity_of_suspects()) <
         misfit(last.stamp, last.received, velocity().value_or(Velocity()));
}

void OdometryBuffer::learn_step(const StampedOdometry& next) {
  const std::optional<Velocity> before = velocity();
  const ros::Time stamp = suspects_.empty() ? newest() : suspects_.back().stamp;
  const Pose2& pose = suspects_.empty() ? newest_pose() : suspects_.back().pose;
  if (!before || !continues(stamp, pose, next)) return;
  learnt_.add_step(relative(pose, next.pose), (next.stamp - stamp).toSec(), *before);
}

void OdometryBuffer::push(const StampedOdometry& odometry, const std::optional<Pose2>& given) {
  OdometrySample sample;
  sample.stamp = odometry.stamp;
  sample.received = odometry.pose;
  sample.covariance = odometry.covariance;
  sample.heading = odometry.heading;
  if (samples_.empty()) {
    offset_ = Pose2{};
  } else {
    const OdometrySample& last = samples_.back();
    std::optional<Pose2> motion = given;
    if (last.heading && odometry.heading) {
      motion = turned_by(motion.value_or(relative(last.received, odometry.pose)),
                         wrap_angle(*odometry.heading - *last.heading));
    }
    if (motion) offset_ = compose(compose(last.pose, *motion), relative(odometry.pose, Pose2{}));
    if (!given && options_.use_covariance) {
      if (last.covariance && odometry.covariance) {
        sample.step_covariance =
            covariance_growth(last.received, odometry.pose, *last.covariance, *odometry.covariance);
      }
      const Pose2 step = relative(last.received, odometry.pose);
      const bool stands = step.x == 0.0 && step.y == 0.0 && step.heading == 0.0;
      if (!sample.step_covariance && options_.use_twist_covariance && !stands) {
        sample.step_covariance =
            covariance_of_step(odometry.velocity_variances, (odometry.stamp - last.stamp).toSec());
      }
    }
  }
  sample.pose = compose(offset_, odometry.pose);
  samples_.push_back(sample);
  if (const std::optional<Velocity> reached = velocity()) {
    learnt_.add_velocity(*reached);
    samples_.back().may_slip = learnt_.may_slip();
  }
}

OdometryBuffer::Addition OdometryBuffer::add(const StampedOdometry& odometry, ros::Time used) {
  if (samples_.empty()) {
    push(odometry);
    return Addition::added;
  }
  if (newest().toSec() > options_.length) {
    forget_before(std::min(used, newest() - ros::Duration(options_.length)));
  }
  if (is_full()) forget_before(std::min(used, middle()));
  const bool is_believed = continues_newest(odometry) && !continues_suspects(odometry);
  learn_step(odometry);
  if (!is_believed) return suspect(odometry);
  suspects_.clear();
  push(odometry);
  return Addition::added;
}

OdometryBuffer::Addition OdometryBuffer::suspect(const StampedOdometry& odometry) {
  const auto comes_late_after = [&](ros::Time stamp) {
    const double duration = (odometry.stamp - stamp).toSec();
    return duration <= 0.0 && duration >= -options_.jump_back;
  };
  const OdometrySample& last = samples_.back();
  if (comes_late_after(last.stamp)) return Addition::out_of_order;
  if (!suspects_.empty()) {
    const StampedOdometry& newest = suspects_.back();
    if (comes_late_after(newest.stamp)) return Addition::out_of_order;
    if (!continues(newest.stamp, newest.pose, odometry)) suspects_.clear();
  }
  if (suspects_.empty()) {
    const double duration = (odometry.stamp - last.stamp).toSec();
    const double distance =
        std::hypot(odometry.pose.x - last.received.x, odometry.pose.y - last.received.y);
    const bool is_gap = duration > options_.max_gap && learnt_.reaches(distance, duration) &&
                        distance <= options_.max_speed * duration + kPositionSlack;
    suspicion_ = duration < 0.0 || duration > kLongestGap ? Addition::time_jump
                 : is_gap                                 ? Addition::time_gap
                                                          : Addition::pose_jump;
  }
  suspects_.push_back(odometry);
  if (suspects_have_moved()) return believe_suspects(Addition::added);
  const bool is_confirmed = static_cast<int>(suspects_.size()) >= options_.confirmations;
  return is_confirmed ? believe_suspects(suspicion_) : suspicion_;
}

// Whether the step to them is explained by how the robot drove before it and does since.
bool OdometryBuffer::suspects_have_moved() const {
  if (suspicion_ != Addition::pose_jump || suspects_.size() < 2) return false;
  const OdometrySample& last = samples_.back();
  const StampedOdometry& first = suspects_.front();
  const double step = (first.stamp - last.stamp).toSec();
  const std::optional<Velocity> before = velocity();
  return before && continues(last.stamp, last.received, first) &&
         (suspects_.back().stamp - first.stamp).toSec() >= 0.5 * step &&
         LearntMotion::is_between(relative(last.received, first.pose), step, *before,
                                  velocity_of_suspects());
}

// One that stands on either side of it has not moved: a base that is started again stands.
Pose2 OdometryBuffer::motion_of_jump(ros::Time until) const {
  const double duration = (until - newest()).toSec();
  const Velocity before = velocity().value_or(Velocity());
  const Velocity after = velocity_of_suspects();
  if (duration > kLongestJump || !before.is_moving() || !after.is_moving()) return Pose2{};
  return motion_of(mixed(before, after, 0.5), duration);
}

OdometryBuffer::Addition OdometryBuffer::believe_suspects(Addition suspicion) {
  std::optional<Pose2> motion;
  if (suspicion == Addition::time_jump) samples_.clear();
  if (suspicion == Addition::pose_jump) motion = motion_of_jump(suspects_.front().stamp);
  const std::vector<StampedOdometry> believed = std::move(suspects_);
  suspects_.clear();
  for (const StampedOdometry& odometry : believed) {
    push(odometry, motion);
    motion.reset();
  }
  return suspicion == Addition::time_jump   ? Addition::time_jumped
         : suspicion == Addition::time_gap  ? Addition::gap_closed
         : suspicion == Addition::pose_jump ? Addition::pose_jumped
                                            : Addition::added;
}

void OdometryBuffer::clear() {
  samples_.clear();
  suspects_.clear();
}

void OdometryBuffer::save(ros::Time from, SavedProgress* progress) const {
  progress->odometry_offset = offset_;
  progress->odometry.clear();
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    if (i + 1 < samples_.size() && samples_[i + 1].stamp + ros::Duration(kVelocitySpan) <= from) {
      continue;
    }
    progress->odometry.push_back(samples_[i]);
    progress->odometry.back().heading.reset();
  }
  progress->speed = learnt_.speed();
}

void OdometryBuffer::resume(const SavedProgress& progress) {
  clear();
  offset_ = progress.odometry_offset;
  samples_.assign(progress.odometry.begin(), progress.odometry.end());
  learnt_.resume(progress.speed);
}

void OdometryBuffer::forget_before(ros::Time stamp) {
  while (samples_.size() > 2 && samples_[1].stamp <= stamp) samples_.pop_front();
}

bool OdometryBuffer::covers(ros::Time stamp) const {
  return !samples_.empty() && oldest() <= stamp && stamp <= newest();
}

Pose2 OdometryBuffer::pose_within(const OdometrySample& first, const OdometrySample& second,
                                  double share) const {
  if (share <= 0.0) return first.pose;
  if (share >= 1.0) return second.pose;
  return compose(first.pose, part_of(relative(first.pose, second.pose), share));
}

OdometryIncrement OdometryBuffer::integrate(ros::Time from, ros::Time to,
                                            const OdometryNoise& noise) const {
  OdometryIncrement increment;
  extend(from, to, noise, &increment);
  return increment;
}

void OdometryBuffer::extend(ros::Time from, ros::Time to, const OdometryNoise& noise,
                            OdometryIncrement* increment) const {
  if (!covers(from) || !covers(to) || from > to) {
    throw Error("odometry from " + text_of(from) + " to " + text_of(to) +
                (empty() ? " is not there: none received"
                         : " is not covered: it reaches from " + text_of(oldest()) + " to " +
                               text_of(newest())));
  }
  // First step that ends after `from`; observations are recent, so the search starts at the end.
  std::size_t second = samples_.size() - 1;
  while (second > 1 && samples_[second - 1].stamp > from) --second;
  for (; from < to && second < samples_.size(); ++second) {
    const OdometrySample& a = samples_[second - 1];
    const OdometrySample& b = samples_[second];
    const double step = (b.stamp - a.stamp).toSec();
    const double begin = (std::max(from, a.stamp) - a.stamp).toSec() / step;
    const double end = (std::min(to, b.stamp) - a.stamp).toSec() / step;
    if (end <= begin) break;
    const Pose2 start = pose_within(a, b, begin);
    const Pose2 motion = relative(start, pose_within(a, b, end));
    if (b.step_covariance) {
      const Eigen::Matrix3d to_start = by_second(increment->mean);
      append(OdometryNoise::none(), motion, step * (end - begin), increment);
      increment->covariance += (end - begin) * to_start * *b.step_covariance * to_start.transpose();
    } else {
      append(noise, motion, step * (end - begin), increment);
    }
    if (b.may_slip) {
      const double duration = step * (end - begin);
      increment->slip_covariance +=
          slip_covariance(std::hypot(motion.x, motion.y) / duration, duration);
    }
    if (b.stamp >= to) break;
  }
}

}  // namespace pf_resampling
