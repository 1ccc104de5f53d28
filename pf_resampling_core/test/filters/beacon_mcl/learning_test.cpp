// What BeaconMcl learns besides the pose, against closed forms: where the pose is known scale and
// bias of the ranges are a linear regression, the yaw-rate bias a linear Gaussian estimate, and the
// noise a variance.

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "pf_resampling_core/test/filters/beacon_mcl/filter_testing.hpp"
#include "pf_resampling_core/test/simulation/chi_square.hpp"

namespace pf_resampling {
namespace {

double distance_of(const Beacon& beacon, const Pose2& pose) {
  return std::hypot(beacon.position.x() - pose.x, beacon.position.y() - pose.y);
}

double noise(std::uint64_t index) {
  return RandomStream(53, RandomPurpose::test, 0).normal(index);
}

// Scale and bias by the information form of Bayesian linear regression.
struct Regression {
  Regression(const RangeCalibration& prior, double scale_sigma, double bias_sigma) {
    information.diagonal() << 1.0 / (scale_sigma * scale_sigma), 1.0 / (bias_sigma * bias_sigma);
    weighted = information * Eigen::Vector2d(prior.scale, prior.bias);
  }
  void add(double distance, double range, double variance) {
    const Eigen::Vector2d row(distance, 1.0);
    information += row * row.transpose() / variance;
    weighted += row * range / variance;
  }
  // The random walk of (scale, bias) over `duration`, with the given deviations per square root of
  // a second.
  void walk(double scale_walk, double bias_walk, double duration) {
    Eigen::Matrix2d covariance = information.inverse();
    const Eigen::Vector2d mean = covariance * weighted;
    covariance(0, 0) += scale_walk * scale_walk * duration;
    covariance(1, 1) += bias_walk * bias_walk * duration;
    information = covariance.inverse();
    weighted = information * mean;
  }
  void expect(const CalibrationEstimate& estimate, double tolerance) const {
    const Eigen::Matrix2d covariance = information.inverse();
    const Eigen::Vector2d mean = covariance * weighted;
    EXPECT_NEAR(estimate.scale, mean[0], tolerance * std::sqrt(covariance(0, 0)));
    EXPECT_NEAR(estimate.bias, mean[1], tolerance * std::sqrt(covariance(1, 1)));
    EXPECT_NEAR(estimate.scale_sigma / std::sqrt(covariance(0, 0)), 1.0, tolerance);
    EXPECT_NEAR(estimate.bias_sigma / std::sqrt(covariance(1, 1)), 1.0, tolerance);
  }
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  Eigen::Vector2d weighted = Eigen::Vector2d::Zero();
};

BeaconMclOptions calibrating(CalibrationEstimation estimation) {
  BeaconMclOptions options = known_pose_options();
  options.calibration.estimation = estimation;
  options.calibration.scale_sigma = 0.05;
  options.calibration.bias_sigma = 0.5;
  options.ranges.sigma = 0.3;
  return options;
}

// The robot drives a known path through the square.
Pose2 path(int step) {
  return compose({8.0, 9.0, 0.3}, {0.15 * step, 0.0, 0.0});
}

OdometryIncrement path_step(const BeaconMclOptions& options) {
  return step_of(options.odometry, {0.15, 0.0, 0.0}, 0.2);
}

// Ranges of the beacons in turn along the path, 7 % too long and 0.2 m too short, for both.
void drive(double scale_walk, double bias_walk, BeaconMcl* filter, Regression* regression) {
  for (int i = 1; i <= 80; ++i) {
    const Beacon& beacon = filter->beacons()[static_cast<std::size_t>(i % 4)];
    const double distance = distance_of(beacon, path(i));
    const double range = 1.07 * distance - 0.2 + 0.3 * noise(static_cast<std::uint64_t>(i));
    filter->update(path_step(filter->options()), {range_of(beacon.id, range)});
    regression->walk(scale_walk, bias_walk, 0.2);
    regression->add(distance, range, 0.09);
  }
}

TEST(Calibration, OneForAllIsALinearRegression) {
  for (const double walk : {0.0, 1.0}) {
    BeaconMclOptions options = calibrating(CalibrationEstimation::shared);
    options.calibration.scale_walk = 2e-3 * walk;
    options.calibration.bias_walk = 2e-2 * walk;
    const RangeCalibration nominal{1.02, 0.1, 0.0};
    BeaconMcl filter(options, square_of_beacons(), 1, {{-1, nominal}});
    Regression regression(nominal, 0.05, 0.5);
    drive(2e-3 * walk, 2e-2 * walk, &filter, &regression);
    ASSERT_EQ(filter.calibration().size(), 1u);
    EXPECT_EQ(filter.calibration().front().beacon, -1);
    regression.expect(filter.calibration().front(), 1e-6);
    const CalibrationEstimate estimate = filter.calibration().front();
    EXPECT_NEAR(filter.corrected_range(3, 10.0), (10.0 - estimate.bias) / estimate.scale, 1e-12);
  }
}

// Radios that are known to differ, and one error that all of them share on top (the firmware, the
// temperature): each keeps its own difference.
TEST(Calibration, OneForAllIsOnTopOfWhatIsKnownOfEach) {
  const BeaconMclOptions options = calibrating(CalibrationEstimation::shared);
  const std::vector<std::pair<int, RangeCalibration>> nominal = {
      {1, {1.0, 0.0, 0.0}}, {2, {1.1, 2.0, 0.0}}, {3, {0.9, -1.0, 0.0}}, {4, {1.0, 0.5, 0.0}}};
  BeaconMcl filter(options, square_of_beacons(), 1, nominal);
  // Before any range: what is given.
  for (const auto& [beacon, given] : nominal) {
    EXPECT_NEAR(filter.corrected_range(beacon, given.scale * 10.0 + given.bias), 10.0, 1e-12);
  }
  // All of them measure distances 3 % too long.
  for (int i = 1; i <= 200; ++i) {
    const auto& [beacon, given] = nominal[static_cast<std::size_t>(i % 4)];
    const double distance =
        distance_of(filter.beacons()[static_cast<std::size_t>(i % 4)], path(i / 4));
    filter.update(i % 4 == 0 ? path_step(options) : OdometryIncrement{},
                  {range_of(beacon, given.scale * 1.03 * distance + given.bias)});
    // A start with errors of 5 % of 10 m, and never what another radio's bias would be.
    EXPECT_LT(std::abs(filter.status().innovation), 0.7) << i;
  }
  for (const auto& [beacon, given] : nominal) {
    EXPECT_NEAR(filter.corrected_range(beacon, given.scale * 1.03 * 12.0 + given.bias), 12.0, 0.05)
        << beacon;
  }
  ASSERT_EQ(filter.calibration().size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    const CalibrationEstimate estimate = filter.calibration()[i];
    EXPECT_EQ(estimate.beacon, nominal[i].first);
    EXPECT_NEAR(estimate.scale, 1.03 * nominal[i].second.scale, 5.0 * estimate.scale_sigma + 0.01);
    EXPECT_GT(estimate.scale_sigma, 0.0);
  }
}

TEST(Calibration, OffBelievesWhatIsGiven) {
  const BeaconMclOptions options = calibrating(CalibrationEstimation::off);
  BeaconMcl filter(options, square_of_beacons(), 1,
                   {{-1, {1.02, 0.1, 0.0}}, {3, {0.97, 0.0, 0.0}}});
  for (int i = 0; i < 20; ++i) filter.update({}, {range_of(1 + i % 4, 15.0)});
  ASSERT_EQ(filter.calibration().size(), 4u);
  EXPECT_EQ(filter.calibration()[0].scale, 1.02);
  EXPECT_EQ(filter.calibration()[2].scale, 0.97);
  EXPECT_EQ(filter.calibration()[2].scale_sigma, 0.0);
}

// With resampling, excitation and a little odometry noise the population still holds about the
// posterior that the known path gives.
TEST(Calibration, IsKeptThroughRenewals) {
  BeaconMclOptions options = calibrating(CalibrationEstimation::shared);
  options.particles = 2000;
  options.strategy.schedule = Schedule::always;
  options.strategy.excitation.method = Excitation::regularized;
  options.odometry.translation_per_distance = options.odometry.slip_per_distance = 1e-3;
  options.odometry.heading_per_distance = 1e-4;
  BeaconMcl filter(options, square_of_beacons(), 1);
  Regression regression({1.0, 0.0, 0.0}, 0.05, 0.5);
  drive(options.calibration.scale_walk, options.calibration.bias_walk, &filter, &regression);
  EXPECT_EQ(filter.status().renewals, 80);
  regression.expect(filter.calibration().front(), 0.2);
}

// --- Yaw-rate bias -------------------------------------------------------------------------------

// The robot stands, its antenna two metres ahead, and the gyro says it does not turn. The range to
// a beacon at its side tells how far it did turn: heading = -b T + n, range = d + g heading + e,
// all Gaussian. So the posterior of the bias is known. The population's mean errs by its standard
// deviation over the root of N_eff: beyond 4.89 of these, plus a hundredth of the deviation for the
// curvature of the circle: false alarm 2e-6 in all.
TEST(YawRateBias, IsALinearGaussianEstimate) {
  constexpr double kDuration = 10.0;
  constexpr double kBiasSigma = 0.002;
  for (const double heading_per_time : {0.0, 0.005}) {
    BeaconMclOptions options = known_pose_options();
    options.particles = 40000;
    options.ranges.sigma = 0.03;
    options.yaw_rate_bias.estimate = true;
    options.yaw_rate_bias.sigma = kBiasSigma;
    options.yaw_rate_bias.walk = 0.0;
    options.odometry.heading_per_time = heading_per_time;
    options.initialization.x = options.initialization.y = options.initialization.heading = 0.0;
    BeaconMcl filter(options, {{1, {2.0, 500.0, 0.0}, true}}, 1);
    EXPECT_EQ(filter.yaw_rate_bias().mean, 0.0);
    EXPECT_NEAR(filter.yaw_rate_bias().sigma, kBiasSigma, 1e-12);

    // Two metres ahead and beside the beacon: a turn by h shortens the range by 2 h.
    const double range = 500.0 + 2.0 * 0.0025 * kDuration;
    filter.update(step_of(options.odometry, {}, kDuration),
                  {range_of(1, range, 0.0, {2.0, 0.0, 0.0})});
    const double slope = 2.0 * kDuration;  // range by bias
    const double variance = kBiasSigma * kBiasSigma;
    const double innovation_variance =
        slope * slope * variance + 4.0 * heading_per_time * heading_per_time * kDuration + 9e-4;
    const double gain = variance * slope / innovation_variance;
    const double mean = gain * (range - 500.0);
    const double sigma = std::sqrt(variance - gain * slope * variance);
    const double error =
        kOneInAMillion * sigma / std::sqrt(filter.status().effective_sample_size) + 0.01 * sigma;
    EXPECT_NEAR(filter.yaw_rate_bias().mean, mean, error) << heading_per_time;
    EXPECT_NEAR(filter.yaw_rate_bias().sigma, sigma, error) << heading_per_time;
  }
}

// Without ranges nothing is learnt, though every particle's filter thinks it sees its bias in its
// own turns: over the population the variance is the prior's plus the walk's. Pooled over 20,000
// particles: beyond 4.89 deviations of sqrt(2 / 20,000), false alarm 2e-6.
TEST(YawRateBias, WithoutRangesOnlyTheWalkShows) {
  BeaconMclOptions options = plain_options();
  options.particles = 20000;
  options.yaw_rate_bias.estimate = true;
  options.yaw_rate_bias.sigma = 0.01;
  options.yaw_rate_bias.walk = 0.002;
  options.odometry.heading_per_time = 0.02;
  BeaconMcl filter(options, square_of_beacons(), 1);
  for (int i = 0; i < 50; ++i) filter.update(step_of(options.odometry, {1, 0, 0}, 1.0), {});
  const double sigma = std::sqrt(1e-4 + 4e-6 * 50.0);
  EXPECT_NEAR(filter.yaw_rate_bias().sigma / sigma, 1.0, 0.5 * kOneInAMillion * 0.01);
  EXPECT_LT(std::abs(filter.yaw_rate_bias().mean), kOneInAMillion * sigma / std::sqrt(20000.0));
}

// --- Noise of the ranges -------------------------------------------------------------------------

// At a known place the residual is the noise: its square is averaged with forgetting, the prior
// being worth so many ranges.
TEST(RangeNoise, AtAKnownPlaceIsTheForgettingMeanOfSquares) {
  BeaconMclOptions options = known_pose_options();
  options.ranges.sigma = 0.5;
  options.noise_estimation.ranges = true;
  options.noise_estimation.prior_count = 30.0;
  options.noise_estimation.memory = 100.0;
  BeaconMcl filter(options, square_of_beacons(), 1);
  double squares = 30.0;
  double count = 30.0;
  const double keep = std::exp(-0.01);
  const Pose2 place{8.0, 9.0, 0.3};
  for (int i = 1; i <= 300; ++i) {
    const Beacon& beacon = filter.beacons()[static_cast<std::size_t>(i % 4)];
    const double residual = 0.8 * noise(static_cast<std::uint64_t>(i));
    // Every third message brings a variance of its own; the factor is common to all.
    const double variance = i % 3 == 0 ? 0.16 : 0.0;
    filter.update({}, {range_of(beacon.id, distance_of(beacon, place) + residual, variance)});
    squares = keep * squares + residual * residual / (i % 3 == 0 ? 0.16 : 0.25);
    count = keep * count + 1.0;
    ASSERT_NEAR(range_noise_factor(filter), std::sqrt(squares / count), 1e-9) << i;
  }
}

// From a nominal deviation of 1 m to the true one, smaller or larger. The mean of squares over the
// last 500 or so ranges has a relative deviation of sqrt(2 / 1000), the factor half of that, beyond
// 4.89 of which: 11 %; what the outlier floor takes of the tails stays below 5 %. False alarm 2e-6.
TEST(RangeNoise, FindsTheTrueDeviation) {
  for (const double truth : {0.3, 3.0}) {
    BeaconMclOptions options = known_pose_options();
    options.ranges.sigma = 1.0;
    options.ranges.outlier_share = 0.05;
    options.noise_estimation.ranges = true;
    BeaconMcl filter(options, square_of_beacons(), 1);
    for (int i = 1; i <= 3000; ++i) {
      const Beacon& beacon = filter.beacons()[static_cast<std::size_t>(i % 4)];
      const double range =
          distance_of(beacon, {8.0, 9.0, 0.3}) + truth * noise(static_cast<std::uint64_t>(i));
      if (range > 0.0) filter.update({}, {range_of(beacon.id, range)});
    }
    EXPECT_NEAR(range_noise_factor(filter) / truth, 1.0, 0.16) << truth;
  }
}

// The same on a drive, with pose and calibration to be found as well and one range in twenty an
// outlier. What the pose errs is told apart from the noise only as well as its own uncertainty is
// known: 25 %.
TEST(RangeNoise, FindsTheTrueDeviationOnADrive) {
  World world = circle_among_six_beacons(1.05, 0.2, 150.0);
  world.ranges.outlier_share = 0.05;
  world.ranges.outlier_max = 40.0;
  for (const double nominal : {0.15, 1.0}) {
    BeaconMclOptions options;
    options.ranges.sigma = nominal;
    BeaconMcl filter(options, beacons_of(world), 2);
    run_drive(simulate(world, 2), &filter, [](double, const Pose2&) {});
    EXPECT_NEAR(range_noise_factor(filter) * nominal / 0.4, 1.0, 0.25) << nominal;
  }
}

TEST(RangeNoise, OffStaysAtTheNominal) {
  BeaconMclOptions options = known_pose_options();
  BeaconMcl filter(options, square_of_beacons(), 1);
  for (int i = 0; i < 50; ++i) filter.update({}, {range_of(1, 14.0)});
  EXPECT_EQ(range_noise_factor(filter), 1.0);
}

// --- Noise of the dead reckoning -----------------------------------------------------------------

// Mean of the logarithm zero: one-sided normal beyond 4.89 deviations; spread by chi-square. False
// alarm 4e-6.
TEST(OdometryNoiseFactors, StartLogNormal) {
  BeaconMclOptions options = plain_options();
  options.particles = 20000;
  options.noise_estimation.odometry = true;
  options.noise_estimation.odometry_spread = 0.4;
  BeaconMcl filter(options, square_of_beacons(), 1);
  for (const Eigen::ArrayXd* factors :
       {&filter.particles().translation_factor, &filter.particles().heading_factor}) {
    const Eigen::ArrayXd normals = factors->log() / 0.4;
    EXPECT_LT(std::abs(normals.sum()), kOneInAMillion * std::sqrt(20000.0));
    EXPECT_TRUE(is_chi_square(normals.square().sum(), 20000.0));
  }
  const double product =
      (filter.particles().translation_factor.log() * filter.particles().heading_factor.log()).sum();
  EXPECT_LT(std::abs(product / 0.16), kOneInAMillion * std::sqrt(20000.0));
}

TEST(OdometryNoiseFactors, OffIsOne) {
  BeaconMclOptions options = plain_options();
  BeaconMcl filter(options, square_of_beacons(), 1);
  filter.update(step_of(OdometryNoise{}, {0.1, 0, 0}, 0.1), {range_of(1, 14.0)});
  EXPECT_TRUE((filter.particles().translation_factor == 1.0).all());
  EXPECT_TRUE((filter.particles().heading_factor == 1.0).all());
}

// A robot that turns far less exactly than its nominal noise says is found out; one that is as good
// as said is not suspected of the same. Ratio of the learnt factors, over three seeds.
TEST(OdometryNoiseFactors, TellABadOdometryFromAGoodOne) {
  const auto heading_factor = [](double yaw_rate_sigma) {
    World world = circle_among_six_beacons(1.0, 0.0, 120.0);
    world.odometry.yaw_rate_sigma = yaw_rate_sigma;
    double product = 1.0;
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      BeaconMclOptions options;
      options.calibration.estimation = CalibrationEstimation::off;
      options.yaw_rate_bias.estimate = false;
      options.odometry.heading_per_distance = options.odometry.heading_per_angle = 0.0;
      options.odometry.heading_per_time = 0.02;
      BeaconMcl filter(options, beacons_of(world), seed);
      run_drive(simulate(world, seed), &filter, [](double, const Pose2&) {});
      const BeaconMclParticles& particles = filter.particles();
      product *= std::exp((particles.weight * particles.heading_factor.log()).sum());
    }
    return std::cbrt(product);
  };
  // White noise of the yaw rate over periods of 0.1 s: 0.02 rad/sqrt(s) is 0.063 rad/s.
  const double good = heading_factor(0.063);
  const double bad = heading_factor(0.3);
  EXPECT_GT(bad, 1.5 * good);
  EXPECT_GT(good, 1.0 / 3.0);
  EXPECT_LT(good, 2.5);
}

}  // namespace
}  // namespace pf_resampling
