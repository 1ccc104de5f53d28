#include "pf_resampling_core/models/odometry_motion.hpp"

#include <cmath>

namespace pf_resampling {
namespace {

constexpr double kSlipShare = 0.5;        // of the speed, m/s, in m/sqrt(s)
constexpr double kSlipTurnPerTime = 0.4;  // rad/sqrt(s)

double variance(double deviation_per_root, double amount) {
  return deviation_per_root * deviation_per_root * amount;
}

// Covariance of one step, in the frame of its start. Heading noise gathered within the step is that
// of a random walk: it swings the end about the start with variance 1/3 and covariance 1/2 of what
// the whole of it would.
Eigen::Matrix3d step_covariance(const OdometryNoise& noise, const Pose2& motion, double duration) {
  const double distance = std::hypot(motion.x, motion.y);
  const double heading = variance(noise.heading_per_distance, distance) +
                         variance(noise.heading_per_angle, std::abs(motion.heading)) +
                         variance(noise.heading_per_time, duration);
  const double idle = variance(noise.translation_per_time, duration);
  const double along = variance(noise.translation_per_distance, distance) +
                       variance(noise.along_per_time, duration) + idle;
  const double across = variance(noise.slip_per_distance, distance) + idle;
  // Unit vectors along the step and to its left.
  const bool moves = distance > 0.0;
  const Eigen::Vector2d ahead(moves ? motion.x / distance : 1.0, moves ? motion.y / distance : 0.0);
  const Eigen::Vector2d left(-ahead.y(), ahead.x());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  covariance.topLeftCorner<2, 2>() =
      along * ahead * ahead.transpose() +
      (across + heading * distance * distance / 3.0) * left * left.transpose();
  covariance.topRightCorner<2, 1>() = 0.5 * heading * distance * left;
  covariance.bottomLeftCorner<1, 2>() = covariance.topRightCorner<2, 1>().transpose();
  covariance(2, 2) = heading;
  return covariance;
}

}  // namespace

Eigen::Matrix3d slip_covariance(double speed, double duration) {
  const double position = variance(kSlipShare * speed, duration);
  return Eigen::Vector3d(position, position, variance(kSlipTurnPerTime, duration)).asDiagonal();
}

void add_parameters(OdometryNoise* noise, ParameterList* parameters) {
  ParameterList& list = *parameters;
  list.push_back(basic(real_parameter(
      "odometry/translation_per_distance", &noise->translation_per_distance, 0.0, 10.0, "m/sqrt(m)",
      "Standard deviation of the driven distance after one metre.")));
  list.push_back(real_parameter("odometry/slip_per_distance", &noise->slip_per_distance, 0.0, 10.0,
                                "m/sqrt(m)",
                                "Standard deviation of the sideways offset after one metre."));
  list.push_back(real_parameter("odometry/heading_per_distance", &noise->heading_per_distance, 0.0,
                                10.0, "rad/sqrt(m)",
                                "Standard deviation of the heading after one metre."));
  list.push_back(basic(real_parameter(
      "odometry/heading_per_angle", &noise->heading_per_angle, 0.0, 10.0, "rad/sqrt(rad)",
      "Standard deviation of the heading after a turn by one radian.")));
  list.push_back(real_parameter("odometry/heading_per_time", &noise->heading_per_time, 0.0, 10.0,
                                "rad/sqrt(s)",
                                "Standard deviation of the heading after one second."));
  list.push_back(real_parameter("odometry/along_per_time", &noise->along_per_time, 0.0, 10.0,
                                "m/sqrt(s)",
                                "Standard deviation along the motion after one second."));
  list.push_back(real_parameter("odometry/translation_per_time", &noise->translation_per_time, 0.0,
                                10.0, "m/sqrt(s)",
                                "Standard deviation along both axes after one second."));
}

void append(const OdometryNoise& noise, const Pose2& motion, double duration,
            OdometryIncrement* increment) {
  const Eigen::Matrix3d by_past = by_first(increment->mean, motion);
  const Eigen::Matrix3d by_step = by_second(increment->mean);
  increment->covariance = by_past * increment->covariance * by_past.transpose() +
                          by_step * step_covariance(noise, motion, duration) * by_step.transpose();
  increment->slip_covariance = by_past * increment->slip_covariance * by_past.transpose();
  // A constant yaw-rate error turns the step, on average, by half of what it adds to the heading.
  const Eigen::Vector3d step_sensitivity(-0.5 * duration * motion.y, 0.5 * duration * motion.x,
                                         duration);
  const auto propagate = [&](const Eigen::Vector3d& of_step, Eigen::Vector3d* sensitivity) {
    *sensitivity = (by_past * *sensitivity + by_step * of_step).eval();
  };
  propagate(step_sensitivity, &increment->yaw_rate_sensitivity);
  // So does an error of the turn, whatever it comes from.
  const Eigen::Vector3d turning(-0.5 * motion.y, 0.5 * motion.x, 1.0);
  propagate({motion.x, motion.y, 0.0}, &increment->distance_scale_sensitivity);
  propagate(motion.heading * turning, &increment->turn_scale_sensitivity);
  propagate(motion.x * turning, &increment->drift_sensitivity);
  if (duration > 0.0) {
    const double left = std::exp(-duration / OdometryIncrement::kVelocityMemory);
    const Eigen::Vector3d now(motion.x / duration, motion.y / duration, motion.heading / duration);
    increment->velocity = left * increment->velocity + (1.0 - left) * now;
    increment->velocity_left *= left;
  }
  increment->mean = compose(increment->mean, motion);
  increment->duration += duration;
}

}  // namespace pf_resampling
