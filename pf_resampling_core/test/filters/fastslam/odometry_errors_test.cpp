#include "pf_resampling_core/filters/fastslam/odometry_errors.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

using Vector = OdometryErrorEstimator::Vector;
using Matrix = OdometryErrorEstimator::Matrix;
using Jacobian = Eigen::Matrix<double, 3, OdometryErrorEstimator::kCount>;

OdometryIncrement increment_at(int step) {
  OdometryIncrement increment;
  const OdometryNoise noise;
  for (int k = 0; k < 10; ++k) {
    append(noise, {0.02 + 0.01 * std::sin(0.3 * step), 0.0, 0.03 * std::cos(0.2 * step)}, 0.02,
           &increment);
  }
  return increment;
}

Vector prior_sigma(const OdometryErrorOptions& options) {
  Vector sigma;
  sigma << options.distance_scale, options.turn_scale, options.drift, options.yaw_rate,
      options.delay;
  return sigma;
}

// The filters' means are the solution of one linear least squares problem over all motions and the
// prior, and so is the covariance. The Jacobian of the delay by its definition: the pose when the
// observation was made is that of the odometry, moved back by what the robot drives in that time.
TEST(OdometryErrors, AreTheLeastSquaresSolution) {
  OdometryErrorOptions options;
  options.walk = 0.0;
  OdometryErrorEstimator errors;
  const int particles = 3;
  errors.start(options, particles);
  const Vector sigma = prior_sigma(options);
  Matrix information = sigma.array().square().inverse().matrix().asDiagonal();
  std::vector<Vector> right(particles, Vector::Zero());
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (int step = 0; step < 30; ++step) {
    const OdometryIncrement odometry = increment_at(step);
    const Eigen::Vector3d after = odometry.velocity_left * before + odometry.velocity;
    Jacobian jacobian;
    jacobian.col(0) = odometry.distance_scale_sensitivity;
    jacobian.col(1) = odometry.turn_scale_sensitivity;
    jacobian.col(2) = odometry.drift_sensitivity;
    jacobian.col(3) = odometry.yaw_rate_sensitivity;
    const auto delayed = [&](double delay) {
      const Pose2 first{-delay * before.x(), -delay * before.y(), -delay * before.z()};
      const Pose2 last =
          compose(odometry.mean, {-delay * after.x(), -delay * after.y(), -delay * after.z()});
      const Pose2 motion = relative(first, last);
      return Eigen::Vector3d(motion.x, motion.y, motion.heading);
    };
    jacobian.col(4) = (delayed(1e-5) - delayed(-1e-5)) / 2e-5;
    before = after;

    errors.predict(odometry);
    Eigen::ArrayXXd motion(particles, 3);
    for (int i = 0; i < particles; ++i) {
      const Eigen::Vector3d residual(0.01 * std::sin(1.7 * step + i), 0.005 * std::cos(step - i),
                                     0.02 * std::sin(0.7 * step * (i + 1)));
      motion.row(i) << odometry.mean.x + residual.x(), odometry.mean.y + residual.y(),
          odometry.mean.heading + residual.z();
      right[static_cast<std::size_t>(i)] +=
          jacobian.transpose() * odometry.covariance.inverse() * residual;
    }
    information += jacobian.transpose() * odometry.covariance.inverse() * jacobian;
    errors.condition(motion);
  }
  const Matrix covariance = information.inverse();
  for (int i = 0; i < particles; ++i) {
    const Vector solution = covariance * right[static_cast<std::size_t>(i)];
    const Vector mean = errors.state().means.row(i).matrix().transpose();
    EXPECT_LT(((mean - solution).array() / sigma.array()).matrix().norm(), 1e-4)
        << "particle " << i;
    EXPECT_GT((solution.array() / sigma.array()).matrix().norm(), 0.1);
  }
  const Matrix scaled = sigma.cwiseInverse().asDiagonal() *
                        (errors.state().covariance - covariance) *
                        sigma.cwiseInverse().asDiagonal();
  EXPECT_LT(scaled.norm(), 1e-4);
}

// Predicted are the motions with the errors that are expected, and how uncertain these make them.
TEST(OdometryErrors, PredictWhatTheyHaveLearnt) {
  OdometryErrorOptions options;
  options.turn_scale = options.drift = options.yaw_rate = options.delay = 0.0;
  options.distance_scale = 0.1;
  options.walk = 0.0;
  OdometryErrorEstimator errors;
  errors.start(options, 1);
  OdometryIncrement odometry;
  append(OdometryNoise::none(), {2.0, 0.0, 0.0}, 1.0, &odometry);
  errors.predict(odometry);
  EXPECT_NEAR(errors.covariance()(0, 0), 0.04, 1e-12);
  EXPECT_NEAR(errors.covariance()(2, 2), 0.0, 1e-12);
  Eigen::ArrayXXd motion(1, 3);
  motion << 2.2, 0.0, 0.0;
  errors.condition(motion);
  errors.predict(odometry);
  EXPECT_NEAR(errors.motion()(0, 0), 2.2, 1e-6);
  EXPECT_LT(errors.covariance()(0, 0), 1e-9);
}

// A robot that drives in a room of eight landmarks, stops and turns, on wheels 8 % larger than it
// believes, and sees a quarter of a second late. The errors are found, and explain what was seen.
struct Drive {
  double log_likelihood = 0.0;  // of all observations
  Vector mean = Vector::Zero();
  std::int64_t gated = 0;
};

Drive driven(bool estimate, std::uint64_t seed) {
  constexpr double kScale = 1.08, kDelay = 0.25, kStep = 0.05;
  FastSlamOptions options;
  options.particles = 200;
  options.odometry_errors.estimate = estimate;
  options.sensor.range_sigma = 0.05;
  options.sensor.range_sigma_share = 0.0;
  options.sensor.bearing_sigma = 0.01;
  options.odometry.heading_per_time = 0.01;
  FastSlam filter(options, seed);
  const RandomStream normals(seed, RandomPurpose::test, 0);
  std::uint64_t next = 0;
  Pose2 robot;
  std::vector<Pose2> poses;
  OdometryIncrement odometry;
  Drive result;
  const int steps = 2400, late = static_cast<int>(kDelay / kStep + 0.5);
  for (int step = 1; step <= steps; ++step) {
    const int phase = step % 160;
    const double speed = phase < 60 ? 0.8 : 0.0;
    const double yaw_rate = phase >= 80 && phase < 140 ? 0.5 * kPi / 3.0 : 0.0;
    poses.push_back(robot);
    robot = compose(robot, {speed * kStep, 0.0, yaw_rate * kStep});
    append(options.odometry,
           {speed * kStep / kScale, 0.0,
            yaw_rate * kStep + 0.01 * std::sqrt(kStep) * normals.normal(next++)},
           kStep, &odometry);
    if (step % 4 != 0) continue;
    const Pose2 eye = poses[static_cast<std::size_t>(std::max(0, step - late))];
    std::vector<RangeBearingObservation> scan;
    for (int k = 0; k < 8; ++k) {
      const double dx = 1.2 + 4.0 * std::cos(0.785 * k) - eye.x;
      const double dy = 1.2 + 4.0 * std::sin(0.785 * k) - eye.y;
      RangeBearingObservation z;
      z.id = k;
      z.range = std::hypot(dx, dy) + 0.05 * normals.normal(next++);
      z.bearing = wrap_angle(std::atan2(dy, dx) - eye.heading + 0.01 * normals.normal(next++));
      if (std::abs(z.bearing) < 1.0) scan.push_back(z);
    }
    filter.update(odometry, scan);
    odometry = {};
    result.log_likelihood += filter.status().log_likelihood;
  }
  for (int k = 0; k < OdometryErrorEstimator::kCount; ++k) {
    result.mean[k] =
        (filter.particles().weight * filter.odometry_errors().state().means.col(k)).sum();
  }
  result.gated = filter.status().gated;
  return result;
}

TEST(OdometryErrors, AreFoundByFastSlam) {
  const Drive without = driven(false, 1);
  const Drive with = driven(true, 1);
  EXPECT_NEAR(with.mean[0], 0.08, 0.02);
  EXPECT_NEAR(with.mean[4], 0.25, 0.08);
  EXPECT_GT(with.log_likelihood, without.log_likelihood + 100.0);
  EXPECT_LT(with.gated, without.gated / 2 + 5);
}

}  // namespace
}  // namespace pf_resampling
