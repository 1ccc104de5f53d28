#include "pf_resampling_core/smoothing/residuals.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

namespace pf_resampling {
namespace {

constexpr double kStep = 1e-6;
constexpr double kTolerance = 1e-5;

Pose2 moved(const Pose2& pose, int component, double by) {
  return {pose.x + (component == 0 ? by : 0.0), pose.y + (component == 1 ? by : 0.0),
          pose.heading + (component == 2 ? by : 0.0)};
}

// Central differences.
template <typename Function>
auto slope(const Function& value) {
  return ((value(kStep) - value(-kStep)) / (2.0 * kStep)).eval();
}

SensorConstants some_constants() {
  SensorConstants constants;
  constants << 0.03, -0.05, 0.01, 0.002, 0.1, -0.02, 0.015;
  return constants;
}

TEST(Residuals, MotionDerivativesAreDifferences) {
  MotionFactor motion;
  motion.mean = {0.7, -0.1, 0.4};
  motion.covariance << 4e-3, 1e-3, 0.0, 1e-3, 2e-3, 5e-4, 0.0, 5e-4, 1e-3;
  motion.sensitivity << 0.7, 0.02, 0.05, 0.1, 0.3, -0.1, 0.3, 0.2, 0.1, -0.1, 0.0, 0.45, 0.7, 1.0,
      0.2;
  const Pose2 from = {1.0, 2.0, 2.9};
  const Pose2 to = {0.4, 2.3, -2.9};
  const SensorConstants constants = some_constants();
  const Eigen::Matrix3d root = motion_root(motion, 1.5);
  const MotionResidual at = motion_residual(motion, root, from, to, constants);
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(slope([&](double by) {
                  return motion_residual(motion, root, moved(from, i, by), to, constants).value;
                }).isApprox(at.by_from.col(i), kTolerance))
        << i;
    EXPECT_TRUE(slope([&](double by) {
                  return motion_residual(motion, root, from, moved(to, i, by), constants).value;
                }).isApprox(at.by_to.col(i), kTolerance))
        << i;
  }
  for (int k = 0; k < kOdometryConstants; ++k) {
    EXPECT_TRUE(slope([&](double by) {
                  SensorConstants other = constants;
                  other[k] += by;
                  return motion_residual(motion, root, from, to, other).value;
                }).isApprox(at.by_constants.col(k), kTolerance))
        << k;
  }
}

// The odometry's own model: with these constants it measures exactly this motion.
TEST(Residuals, MotionIsTheOdometryWithItsErrorsTakenOut) {
  MotionFactor motion;
  motion.mean = {1.0, 0.0, 0.2};
  motion.covariance.setZero();
  motion.sensitivity(0, SensorConstant::distance_scale) = 1.0;
  motion.sensitivity(2, SensorConstant::turn_scale) = 0.2;
  SensorConstants constants = SensorConstants::Zero();
  constants[SensorConstant::distance_scale] = 0.1;
  constants[SensorConstant::turn_scale] = -0.2;
  const MotionResidual residual =
      motion_residual(motion, Eigen::Matrix3d::Identity(), Pose2{}, {1.1, 0.0, 0.16}, constants);
  EXPECT_LT(residual.value.norm(), 1e-9);  // a turn of 2e4 standard deviations
  const Pose2 expected = corrected_motion(motion, constants);
  EXPECT_NEAR(expected.x, 1.1, 1e-15);
  EXPECT_NEAR(expected.heading, 0.16, 1e-15);
}

TEST(Residuals, ATurnTellsItsShareOfTheScale) {
  MotionFactor motion;
  motion.mean = {0.1, 0.0, 0.001};
  motion.sensitivity(2, SensorConstant::turn_scale) = 0.001;
  motion.turn_share = 0.01;
  const auto by_scale = [&](double turn) {
    SensorConstants constants = SensorConstants::Zero();
    constants[SensorConstant::turn_scale] = turn;
    return motion_residual(motion, Eigen::Matrix3d::Identity(), Pose2{}, {0.1, 0.0, 0.02},
                           constants)
        .by_constants(2, SensorConstant::turn_scale);
  };
  EXPECT_NEAR(by_scale(0.0), -0.01 * 0.02, 1e-9);
  EXPECT_NEAR(by_scale(-2.0), -0.02, 1e-12);  // turns the wrong way: all turns are
}

TEST(Residuals, MotionRootWhitens) {
  MotionFactor motion;
  motion.covariance << 4e-2, 1e-2, 0.0, 1e-2, 2e-2, 5e-3, 0.0, 5e-3, 1e-2;
  const Eigen::Matrix3d root = motion_root(motion, 2.0);
  EXPECT_TRUE((root * 4.0 * motion.covariance * root.transpose())
                  .isApprox(Eigen::Matrix3d::Identity(), 1e-6));
}

void check_sighting_derivatives(double range) {
  SightingFactor sighting;
  sighting.range = range;
  sighting.bearing = 3.0;
  sighting.range_variance = 0.01;
  sighting.bearing_variance = 4e-4;
  sighting.sensor = {0.2, -0.1, 0.5};
  const Pose2 pose = {1.0, 2.0, -2.5};
  const SensorConstants constants = some_constants();
  const Pose2 eye = compose(pose, sighting.sensor);
  const double direction = eye.heading + sighting.bearing + 0.1;
  const Eigen::Vector2d landmark(eye.x + 1.05 * range * std::cos(direction),
                                 eye.y + 1.05 * range * std::sin(direction));
  const auto value = [&](const Pose2& p, const Eigen::Vector2d& l, const SensorConstants& c) {
    return sighting_residual(sighting, {1.3, 1.7, 1.0}, p, l, c).value;
  };
  const SightingResidual at =
      sighting_residual(sighting, {1.3, 1.7, 1.0}, pose, landmark, constants);
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(slope([&](double by) {
                  return value(moved(pose, i, by), landmark, constants);
                }).isApprox(at.by_pose.col(i), kTolerance))
        << range << " m, pose " << i;
  }
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(slope([&](double by) {
                  return value(pose, landmark + by * Eigen::Vector2d::Unit(i), constants);
                }).isApprox(at.by_landmark.col(i), kTolerance))
        << range << " m, landmark " << i;
    EXPECT_TRUE(slope([&](double by) {
                  SensorConstants other = constants;
                  other[SensorConstant::range_scale + i] += by;
                  return value(pose, landmark, other);
                }).isApprox(at.by_constants.col(i), kTolerance))
        << range << " m, constant " << i;
  }
}

TEST(Residuals, SightingDerivativesAreDifferences) {
  check_sighting_derivatives(4.0);
}

TEST(Residuals, SightingDerivativesOfWhatIsNearAreDifferences) {
  check_sighting_derivatives(0.3);
}

TEST(Residuals, WhatLiesUnderTheSensorHasDerivatives) {
  SightingFactor sighting;
  sighting.range = 1e-6;
  sighting.range_variance = 0.01;
  sighting.bearing_variance = 4e-4;
  const SightingResidual residual =
      sighting_residual(sighting, {}, Pose2{}, Eigen::Vector2d::Zero(), SensorConstants::Zero());
  EXPECT_TRUE(residual.value.allFinite());
  EXPECT_LT(residual.by_landmark.cwiseAbs().maxCoeff(), 1e3);
}

// What a slip may add is not scaled with the noise.
TEST(Residuals, OdometryThatMayHaveSlippedCountsForLess) {
  MotionFactor motion;
  motion.covariance = Eigen::Vector3d(0.01, 0.02, 0.03).asDiagonal();
  motion.slip_covariance = Eigen::Vector3d(1.0, 0.0, 0.5).asDiagonal();
  const Eigen::Matrix3d root = motion_root(motion, 2.0);
  const Eigen::Matrix3d covariance = (root.transpose() * root).inverse();
  EXPECT_TRUE(
      covariance.isApprox(Eigen::Vector3d(1.04, 0.08, 0.62).asDiagonal().toDenseMatrix(), 1e-6));
}

// Cauchy: half a square near zero, of weight one; a weight of a half at the width.
TEST(Residuals, RobustLoss) {
  EXPECT_NEAR(robust_cost(1e-6, 2.0), 0.5e-6, 1e-12);
  EXPECT_DOUBLE_EQ(robust_cost(4.0, 2.0), 2.0 * std::log(2.0));
  EXPECT_DOUBLE_EQ(robust_weight(4.0, 2.0), 0.5);
  EXPECT_DOUBLE_EQ(robust_cost(4.0, 0.0), 2.0);
  EXPECT_DOUBLE_EQ(robust_weight(4.0, 0.0), 1.0);
}

}  // namespace
}  // namespace pf_resampling
