#include "pf_resampling_core/smoothing/residuals.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace pf_resampling {
namespace {

// Below so many standard deviations of the range, a sighting is taken as a place, not as an angle.
constexpr double kNear = 5.0;
constexpr double kSmallestDistance = 1e-6;  // m
constexpr double kSmallestSigma = 1e-5;     // m, rad
constexpr double kGrossTurn = 0.4;          // of the scale of turns, less 1

Eigen::Matrix2d rotation(double angle) {
  const double cosine = std::cos(angle);
  const double sine = std::sin(angle);
  Eigen::Matrix2d matrix;
  matrix << cosine, -sine, sine, cosine;
  return matrix;
}

}  // namespace

Eigen::Matrix3d motion_root(const MotionFactor& motion, double scale) {
  const Eigen::Matrix3d covariance =
      scale * scale *
          (motion.covariance + kSmallestSigma * kSmallestSigma * Eigen::Matrix3d::Identity()) +
      motion.slip_covariance;
  const Eigen::LLT<Eigen::Matrix3d> root(covariance);
  return root.matrixL().solve(Eigen::Matrix3d::Identity());
}

MotionResidual motion_residual(const MotionFactor& motion, const Eigen::Matrix3d& root,
                               const Pose2& from, const Pose2& to,
                               const SensorConstants& constants) {
  const Pose2 moved = relative(from, to);
  const double stretch = 1.0 / (1.0 + constants[SensorConstant::distance_scale]);
  const double turn = constants[SensorConstant::turn_scale];
  const double missing = wrap_angle(moved.heading - motion.mean.heading);
  const double turned = motion.sensitivity(2, SensorConstant::turn_scale) + missing;
  const double share = std::abs(turn) > kGrossTurn ? 1.0 : motion.turn_share;
  const double kept = 1.0 - share * turn / (1.0 + turn);

  MotionResidual residual;
  residual.value << stretch * moved.x - motion.mean.x, stretch * moved.y - motion.mean.y,
      missing - share * turn / (1.0 + turn) * turned;
  residual.by_constants = -motion.sensitivity;
  residual.by_constants(0, SensorConstant::distance_scale) = 0.0;
  residual.by_constants(1, SensorConstant::distance_scale) = 0.0;
  residual.by_constants(2, SensorConstant::turn_scale) = 0.0;
  residual.value += residual.by_constants * constants.head<kOdometryConstants>();
  residual.by_constants(0, SensorConstant::distance_scale) = -stretch * stretch * moved.x;
  residual.by_constants(1, SensorConstant::distance_scale) = -stretch * stretch * moved.y;
  residual.by_constants(2, SensorConstant::turn_scale) =
      -share * turned / ((1.0 + turn) * (1.0 + turn));

  const Eigen::Matrix2d inverse = rotation(-from.heading);
  residual.by_from.setZero();
  residual.by_from.topLeftCorner<2, 2>() = -stretch * inverse;
  residual.by_from(0, 2) = stretch * moved.y;
  residual.by_from(1, 2) = -stretch * moved.x;
  residual.by_from(2, 2) = -kept;
  residual.by_to.setZero();
  residual.by_to.topLeftCorner<2, 2>() = stretch * inverse;
  residual.by_to(2, 2) = kept;

  residual.value = (root * residual.value).eval();
  residual.by_from = (root * residual.by_from).eval();
  residual.by_to = (root * residual.by_to).eval();
  residual.by_constants = (root * residual.by_constants).eval();
  return residual;
}

SightingResidual sighting_residual(const SightingFactor& sighting, const NoiseScales& noise,
                                   const Pose2& pose, const Eigen::Vector2d& landmark,
                                   const SensorConstants& constants) {
  const Eigen::Matrix2d to_sensor = rotation(-sighting.sensor.heading);
  const Eigen::Matrix2d to_body = rotation(-pose.heading);
  const Eigen::Vector2d in_body = to_body * (landmark - Eigen::Vector2d(pose.x, pose.y));
  const Eigen::Vector2d seen =
      to_sensor * (in_body - Eigen::Vector2d(sighting.sensor.x, sighting.sensor.y));
  const double stretch = 1.0 + constants[SensorConstant::range_scale];
  const double bearing = sighting.bearing - constants[SensorConstant::bearing_bias];
  const double range_sigma = noise.range * std::sqrt(sighting.range_variance);
  double bearing_sigma = noise.bearing * std::sqrt(sighting.bearing_variance);

  SightingResidual residual;
  Eigen::Matrix2d by_seen;
  residual.by_constants.setZero();
  if (sighting.range < kNear * range_sigma) {
    const Eigen::Vector2d along(std::cos(bearing), std::sin(bearing));
    const Eigen::Vector2d across(-along.y(), along.x());
    bearing_sigma *= std::hypot(sighting.range, range_sigma);
    residual.value << (stretch * along.dot(seen) - sighting.range) / range_sigma,
        across.dot(seen) / bearing_sigma;
    by_seen.row(0) = stretch / range_sigma * along;
    by_seen.row(1) = across / bearing_sigma;
    residual.by_constants << along.dot(seen) / range_sigma,
        -stretch * across.dot(seen) / range_sigma, 0.0, along.dot(seen) / bearing_sigma;
  } else {
    const double distance = std::max(kSmallestDistance, seen.norm());
    residual.value << (stretch * distance - sighting.range) / range_sigma,
        wrap_angle(std::atan2(seen.y(), seen.x()) - bearing) / bearing_sigma;
    by_seen << stretch * seen.x() / distance / range_sigma,
        stretch * seen.y() / distance / range_sigma,
        -seen.y() / (distance * distance) / bearing_sigma,
        seen.x() / (distance * distance) / bearing_sigma;
    residual.by_constants(0, 0) = distance / range_sigma;
    residual.by_constants(1, 1) = 1.0 / bearing_sigma;
  }
  residual.by_landmark = by_seen * to_sensor * to_body;
  residual.by_pose.leftCols<2>() = -residual.by_landmark;
  residual.by_pose.col(2) = by_seen * to_sensor * Eigen::Vector2d(in_body.y(), -in_body.x());
  return residual;
}

double robust_cost(double squared, double width) {
  return width > 0.0 ? 0.5 * width * width * std::log1p(squared / (width * width)) : 0.5 * squared;
}

double robust_weight(double squared, double width) {
  return width > 0.0 ? 1.0 / (1.0 + squared / (width * width)) : 1.0;
}

}  // namespace pf_resampling
