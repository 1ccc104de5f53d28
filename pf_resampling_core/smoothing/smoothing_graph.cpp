#include "pf_resampling_core/smoothing/smoothing_graph.hpp"

#include <cmath>

namespace pf_resampling {
namespace {

constexpr double kFixed = 1e-6;          // m, rad: the standard deviation of a pose that is known
constexpr double kSmallestPrior = 1e-9;  // of a constant that is known
constexpr double kMostScaleError = 0.9;

}  // namespace

GaussianPrior prior_at(const Pose2& first, const SensorConstants& sigma) {
  GaussianPrior prior;
  prior.pose = first;
  Eigen::Matrix<double, GaussianPrior::kSize, 1> sigmas;
  sigmas << Eigen::Vector3d::Constant(kFixed), sigma.cwiseMax(kSmallestPrior);
  prior.information = sigmas.cwiseAbs2().cwiseInverse().asDiagonal();
  return prior;
}

bool are_plausible(const SensorConstants& constants) {
  return constants.allFinite() && constants[SensorConstant::distance_scale] > -kMostScaleError &&
         std::abs(1.0 + constants[SensorConstant::turn_scale]) > 1.0 - kMostScaleError &&
         constants[SensorConstant::range_scale] > -kMostScaleError;
}

Pose2 corrected_motion(const MotionFactor& motion, const SensorConstants& constants) {
  const Eigen::Vector3d change = motion.sensitivity * constants.head<kOdometryConstants>();
  return {motion.mean.x + change.x(), motion.mean.y + change.y(),
          wrap_angle(motion.mean.heading + change.z())};
}

}  // namespace pf_resampling
