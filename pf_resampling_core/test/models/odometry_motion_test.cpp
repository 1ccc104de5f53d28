#include "pf_resampling_core/models/odometry_motion.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "pf_resampling_core/population/random_stream.hpp"
#include "pf_resampling_core/test/simulation/chi_square.hpp"

namespace pf_resampling {
namespace {

struct Step {
  Pose2 motion;
  double duration;
};

// Motion of a robot with constant speed and yaw rate: a chord of the circle it drives.
Step arc(double speed, double yaw_rate, double duration) {
  const double angle = yaw_rate * duration;
  if (angle == 0.0) return {{speed * duration, 0.0, 0.0}, duration};
  const double radius = speed / yaw_rate;
  return {{radius * std::sin(angle), radius * (1.0 - std::cos(angle)), angle}, duration};
}

OdometryIncrement increment_of(const OdometryNoise& noise, const std::vector<Step>& steps) {
  OdometryIncrement increment;
  for (const Step& step : steps) append(noise, step.motion, step.duration, &increment);
  return increment;
}

OdometryNoise no_noise() {
  OdometryNoise noise;
  noise.translation_per_distance = noise.slip_per_distance = noise.heading_per_distance = 0.0;
  noise.heading_per_angle = noise.heading_per_time = noise.translation_per_time = 0.0;
  return noise;
}

OdometryNoise all_kinds_of_noise() {
  OdometryNoise noise;
  noise.translation_per_distance = 0.04;
  noise.slip_per_distance = 0.02;
  noise.heading_per_distance = 0.012;
  noise.heading_per_angle = 0.01;
  noise.heading_per_time = 0.004;
  noise.translation_per_time = 0.01;
  return noise;
}

// What the noise means, driven in substeps so small that their own geometry does not matter: the
// heading errs by a random walk while the robot moves, every piece of the way errs along and
// across.
Pose2 noisy_drive(const OdometryNoise& noise, const std::vector<Step>& steps, int substeps,
                  const double* z) {
  Eigen::Vector2d place(0.0, 0.0);
  double heading = 0.0;
  for (const Step& step : steps) {
    const double distance = std::hypot(step.motion.x, step.motion.y) / substeps;
    const double turn = step.motion.heading / substeps;
    const double duration = step.duration / substeps;
    const double idle = noise.translation_per_time * noise.translation_per_time * duration;
    const double along = std::sqrt(std::pow(noise.translation_per_distance, 2) * distance + idle);
    const double across = std::sqrt(std::pow(noise.slip_per_distance, 2) * distance + idle);
    const double turning = std::sqrt(std::pow(noise.heading_per_distance, 2) * distance +
                                     std::pow(noise.heading_per_angle, 2) * std::abs(turn) +
                                     std::pow(noise.heading_per_time, 2) * duration);
    // The chord that an arc's substeps have to give all together: each at the middle heading of
    // its part of the turn, relative to the step's start.
    const double direction = std::atan2(step.motion.y, step.motion.x) - 0.5 * step.motion.heading;
    double shrink = 1.0;
    if (step.motion.heading != 0.0) {
      shrink = substeps * std::sin(0.5 * turn) / std::sin(0.5 * step.motion.heading);
    }
    for (int i = 0; i < substeps; ++i, z += 3) {
      const double error = turning * z[2];
      const double middle = heading + direction + 0.5 * turn + 0.5 * error;
      const Eigen::Vector2d ahead(std::cos(middle), std::sin(middle));
      const Eigen::Vector2d left(-ahead.y(), ahead.x());
      place += (shrink * distance + along * z[0]) * ahead + across * z[1] * left;
      heading += turn + error;
    }
  }
  return {place.x(), place.y(), heading};
}

// Sample covariance of noisy drives against the propagated one. Entries of a sample covariance of n
// normal vectors have variance (c_ii c_jj + c_ij^2) / n; six of them beyond 4.89 deviations: false
// alarm 6e-6. `model_error`: what the first order and chords for arcs may cost, as a share of
// sqrt(c_ii c_jj).
void expect_covariance(const OdometryNoise& noise, const std::vector<Step>& steps,
                       double model_error) {
  constexpr int kDrives = 20000;
  constexpr int kSubsteps = 8;
  const OdometryIncrement increment = increment_of(noise, steps);
  const int draws = 3 * kSubsteps * static_cast<int>(steps.size());
  std::vector<double> z(static_cast<std::size_t>(draws));
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  for (std::uint32_t drive = 0; drive < kDrives; ++drive) {
    RandomStream(23, RandomPurpose::test, drive).fill_normal(0, draws, z.data());
    const Pose2 end = noisy_drive(noise, steps, kSubsteps, z.data());
    const Eigen::Vector3d error(end.x - increment.mean.x, end.y - increment.mean.y,
                                std::remainder(end.heading - increment.mean.heading, 2 * M_PI));
    squares += error * error.transpose();
  }
  const Eigen::Matrix3d sample = squares / kDrives;
  const Eigen::Matrix3d& expected = increment.covariance;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j <= i; ++j) {
      const double scale = std::sqrt(expected(i, i) * expected(j, j));
      const double deviation =
          std::sqrt((expected(i, i) * expected(j, j) + expected(i, j) * expected(i, j)) / kDrives);
      EXPECT_NEAR(expected(i, j), sample(i, j), kOneInAMillion * deviation + model_error * scale)
          << "entry " << i << j << "\npropagated\n"
          << expected << "\nsampled\n"
          << sample;
    }
  }
}

TEST(OdometryIncrement, MeanOfArcsIsTheArc) {
  OdometryIncrement increment;
  for (int i = 0; i < 200; ++i) {
    const Step step = arc(1.5, 0.4, 0.05);
    append(all_kinds_of_noise(), step.motion, step.duration, &increment);
  }
  const Step whole = arc(1.5, 0.4, 10.0);
  EXPECT_NEAR(increment.mean.x, whole.motion.x, 1e-12);
  EXPECT_NEAR(increment.mean.y, whole.motion.y, 1e-12);
  EXPECT_NEAR(std::remainder(increment.mean.heading - 4.0, 2 * M_PI), 0.0, 1e-12);
  EXPECT_LE(std::abs(increment.mean.heading), M_PI);
  EXPECT_NEAR(increment.duration, 10.0, 1e-12);
}

// Straight ahead, on a winding drive and on half a circle. A wide step whose heading noise is large
// against all else shows where that pushes the end.
TEST(OdometryIncrement, CovarianceIsThatOfNoisyDrives) {
  std::vector<Step> winding;
  for (int i = 0; i < 40; ++i) winding.push_back(arc(1.0, 0.8 * std::sin(0.3 * i), 0.1));
  expect_covariance(all_kinds_of_noise(), {{{1.0, 0.0, 0.0}, 0.5}}, 0.005);
  expect_covariance(all_kinds_of_noise(), winding, 0.01);
  expect_covariance(all_kinds_of_noise(), std::vector<Step>(30, arc(1.0, M_PI / 3.0, 0.1)), 0.01);
  OdometryNoise turning = no_noise();
  turning.heading_per_distance = 0.02;
  turning.translation_per_time = 0.003;
  expect_covariance(turning, {{{0.0, 1.0, 0.0}, 0.5}}, 0.01);
  expect_covariance(turning, {{{0.6, -0.8, 0.0}, 0.5}}, 0.01);
}

// A straight step in one piece or in many is the same drive: exactly so in mean and covariance.
TEST(OdometryIncrement, SplittingAStraightStepChangesNothing) {
  const OdometryIncrement whole = increment_of(all_kinds_of_noise(), {{{2.0, 0.0, 0.0}, 1.0}});
  const OdometryIncrement halves =
      increment_of(all_kinds_of_noise(), {{{1.0, 0.0, 0.0}, 0.5}, {{1.0, 0.0, 0.0}, 0.5}});
  const OdometryIncrement uneven =
      increment_of(all_kinds_of_noise(), {{{0.2, 0.0, 0.0}, 0.1}, {{1.8, 0.0, 0.0}, 0.9}});
  EXPECT_LT((whole.covariance - halves.covariance).norm(), 1e-12);
  EXPECT_LT((whole.covariance - uneven.covariance).norm(), 1e-12);
  EXPECT_LT((whole.yaw_rate_sensitivity - halves.yaw_rate_sensitivity).norm(), 1e-12);
  EXPECT_DOUBLE_EQ(halves.mean.x, 2.0);
}

// Central difference of the same controls driven with a yaw rate that errs by a constant.
TEST(OdometryIncrement, YawRateSensitivityIsTheDerivative) {
  std::vector<Step> steps, above, below;
  constexpr double kDifference = 1e-6;
  for (int i = 0; i < 100; ++i) {
    const double speed = 1.0 + 0.5 * std::cos(0.1 * i);
    const double yaw_rate = 0.5 * std::sin(0.07 * i) + 1e-3;
    steps.push_back(arc(speed, yaw_rate, 0.05));
    above.push_back(arc(speed, yaw_rate + kDifference, 0.05));
    below.push_back(arc(speed, yaw_rate - kDifference, 0.05));
  }
  const Pose2 high = increment_of(no_noise(), above).mean;
  const Pose2 low = increment_of(no_noise(), below).mean;
  const Eigen::Vector3d derivative =
      Eigen::Vector3d(high.x - low.x, high.y - low.y, high.heading - low.heading) /
      (2.0 * kDifference);
  const Eigen::Vector3d sensitivity = increment_of(no_noise(), steps).yaw_rate_sensitivity;
  EXPECT_NEAR(sensitivity[2], 5.0, 1e-9);
  EXPECT_LT((sensitivity - derivative).norm(), 1e-3 * derivative.norm())
      << sensitivity.transpose() << " against " << derivative.transpose();
}

// Steps so short that what happens within one does not matter; the derivatives by central
// differences of the whole drive.
TEST(OdometryIncrement, SensitivitiesToScalesAndDriftAreTheDerivatives) {
  const auto drive = [](double distance_scale, double turn_scale, double drift) {
    std::vector<Step> steps;
    for (int k = 0; k < 4000; ++k) {
      Step step = arc(k < 3000 ? 0.7 : -0.4, k < 1500 ? 0.5 : -0.3, 1e-3);
      const double ahead = step.motion.x;
      step.motion.x *= distance_scale;
      step.motion.y *= distance_scale;
      step.motion.heading = turn_scale * step.motion.heading + drift * ahead;
      steps.push_back(step);
    }
    return increment_of(no_noise(), steps);
  };
  const double h = 1e-4;
  const auto derivative = [&](double distance_scale, double turn_scale, double drift) {
    const Pose2 high = drive(1.0 + h * distance_scale, 1.0 + h * turn_scale, h * drift).mean;
    const Pose2 low = drive(1.0 - h * distance_scale, 1.0 - h * turn_scale, -h * drift).mean;
    return Eigen::Vector3d((high.x - low.x) / (2.0 * h), (high.y - low.y) / (2.0 * h),
                           (high.heading - low.heading) / (2.0 * h));
  };
  const OdometryIncrement increment = drive(1.0, 1.0, 0.0);
  EXPECT_LT((increment.distance_scale_sensitivity - derivative(1, 0, 0)).norm(), 1e-3);
  EXPECT_LT((increment.turn_scale_sensitivity - derivative(0, 1, 0)).norm(), 1e-3);
  EXPECT_LT((increment.drift_sensitivity - derivative(0, 0, 1)).norm(), 1e-3);
  EXPECT_GT(increment.turn_scale_sensitivity.norm(), 0.3);
}

// A robot that starts off: the velocity with a memory T follows 1 - exp(-t / T), however the time
// is cut; and increments one after the other are as one.
TEST(OdometryIncrement, VelocityHasAMemory) {
  const double speed = 0.8, yaw_rate = -0.2;
  for (const double duration : {0.01, 0.05, 0.3}) {
    OdometryIncrement increment;
    for (int k = 0; k < 2; ++k) {
      append(no_noise(), {speed * duration, 0.0, yaw_rate * duration}, duration, &increment);
    }
    const double left = std::exp(-2.0 * duration / OdometryIncrement::kVelocityMemory);
    EXPECT_NEAR(increment.velocity_left, left, 1e-12);
    EXPECT_NEAR(increment.velocity.x(), (1.0 - left) * speed, 1e-12);
    EXPECT_NEAR(increment.velocity.z(), (1.0 - left) * yaw_rate, 1e-12);
  }
}

TEST(OdometryIncrement, StandingStillOnlyTimePasses) {
  OdometryNoise noise = no_noise();
  noise.heading_per_time = 0.02;
  noise.translation_per_time = 0.03;
  noise.heading_per_distance = noise.heading_per_angle = 5.0;
  noise.translation_per_distance = noise.slip_per_distance = 5.0;
  OdometryIncrement increment;
  for (int i = 0; i < 40; ++i) append(noise, {}, 0.1, &increment);
  EXPECT_EQ(increment.mean.x, 0.0);
  EXPECT_EQ(increment.mean.y, 0.0);
  EXPECT_EQ(increment.mean.heading, 0.0);
  const Eigen::Vector3d variances = 4.0 * Eigen::Vector3d(9e-4, 9e-4, 4e-4);
  EXPECT_LT((increment.covariance - Eigen::Matrix3d(variances.asDiagonal())).norm(), 1e-15);
  EXPECT_LT((increment.yaw_rate_sensitivity - Eigen::Vector3d(0, 0, 4)).norm(), 1e-12);
}

TEST(OdometryIncrement, TurningOnTheSpotEitherWay) {
  OdometryNoise noise = no_noise();
  noise.heading_per_angle = 0.1;
  for (const double angle : {1.5, -1.5}) {
    const OdometryIncrement increment = increment_of(noise, {{{0.0, 0.0, angle}, 1.0}});
    EXPECT_NEAR(increment.covariance(2, 2), 0.015, 1e-15);
    EXPECT_EQ(increment.covariance.norm(), increment.covariance(2, 2));
  }
}

TEST(OdometryIncrement, IsEmptyUntilTimePasses) {
  OdometryIncrement increment;
  EXPECT_TRUE(increment.is_empty());
  append(all_kinds_of_noise(), {}, 0.0, &increment);
  EXPECT_TRUE(increment.is_empty());
  EXPECT_EQ(increment.covariance.norm(), 0.0);
  append(all_kinds_of_noise(), {0.1, 0.0, 0.0}, 0.1, &increment);
  EXPECT_FALSE(increment.is_empty());
}

}  // namespace
}  // namespace pf_resampling
