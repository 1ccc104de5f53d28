// How a BeaconMcl population comes to be.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "pf_resampling_core/test/filters/beacon_mcl/filter_testing.hpp"
#include "pf_resampling_core/test/simulation/chi_square.hpp"

namespace pf_resampling {
namespace {

constexpr int kPopulation = 20000;

BeaconMclOptions options_for(Initialization method, int particles = kPopulation) {
  BeaconMclOptions options;
  options.particles = particles;
  options.initialization.method = method;
  return options;
}

// Numbers that should be uniform in [low, high]: chi-square over 100 equal bins.
bool is_uniform(const Eigen::ArrayXd& numbers, double low, double high) {
  Eigen::ArrayXd bins = Eigen::ArrayXd::Zero(100);
  for (const double number : numbers) {
    if (number < low || number > high) return false;
    bins[std::min<Eigen::Index>(
        99, static_cast<Eigen::Index>(100.0 * (number - low) / (high - low)))] += 1.0;
  }
  const double expected = static_cast<double>(numbers.size()) / 100.0;
  return is_chi_square((bins - expected).square().sum() / expected, 99.0);
}

void expect_fresh_weights(const BeaconMcl& filter) {
  const double count = static_cast<double>(filter.particles().size());
  EXPECT_TRUE((filter.particles().weight == 1.0 / count).all());
  EXPECT_TRUE((filter.particles().log_weight == -std::log(count)).all());
  EXPECT_EQ(filter.status().particles, filter.particles().size());
  EXPECT_TRUE(all_finite(filter));
}

// Three chi-squares: false alarm 3e-6.
TEST(Initialization, UniformIsUniformOverTheWidenedArea) {
  BeaconMclOptions options = options_for(Initialization::uniform);
  options.initialization.area_margin = 0.1;
  const std::vector<Beacon> beacons = {
      {1, {-5.0, 2.0, 0.0}, true}, {2, {25.0, 2.0, 0.0}, true}, {3, {10.0, 42.0, 3.0}, false}};
  BeaconMcl filter(options, beacons, 1);
  ASSERT_TRUE(filter.is_initialized());
  // A box of 30 x 40 m has a diagonal of 50 m.
  EXPECT_TRUE(is_uniform(filter.particles().x, -10.0, 30.0));
  EXPECT_TRUE(is_uniform(filter.particles().y, -3.0, 47.0));
  EXPECT_TRUE(is_uniform(filter.particles().heading, -M_PI, M_PI));
  expect_fresh_weights(filter);
}

// One beacon, or several in one place: still room about them, as far as ranges go. And beacons in a
// row along a wall, without a margin: the robot is not inside the wall.
TEST(Initialization, UniformAboutOneBeaconOrARowHasRoom) {
  BeaconMclOptions options = options_for(Initialization::uniform);
  options.ranges.maximum_range = 60.0;
  const BeaconMcl one(options, {{1, {100.0, -50.0, 0.0}, true}}, 1);
  EXPECT_TRUE(is_uniform(one.particles().x, 40.0, 160.0));
  EXPECT_TRUE(is_uniform(one.particles().y, -110.0, 10.0));
  options.initialization.area_margin = 0.0;
  const BeaconMcl row(options, {{1, {0.0, 3.0, 0.0}, true}, {2, {40.0, 3.0, 0.0}, true}}, 1);
  EXPECT_TRUE(is_uniform(row.particles().x, 0.0, 40.0));
  EXPECT_TRUE(is_uniform(row.particles().y, -57.0, 63.0));
}

// Mean: three normals; covariance: a chi-square of 60,000 degrees and six products. False alarm
// 1e-5.
TEST(Initialization, GaussianHasTheGivenMoments) {
  BeaconMcl filter(options_for(Initialization::uniform), square_of_beacons(), 1);
  const Pose2 mean{4.0, -3.0, 3.0};
  Eigen::Matrix3d covariance;
  covariance << 2.0, 0.6, 0.1, 0.6, 1.0, -0.1, 0.1, -0.1, 0.05;
  filter.initialize_gaussian(mean, covariance);
  const BeaconMclParticles& p = filter.particles();
  Eigen::MatrixX3d errors(kPopulation, 3);
  for (Eigen::Index i = 0; i < kPopulation; ++i) {
    errors.row(i) << p.x[i] - 4.0, p.y[i] + 3.0, std::remainder(p.heading[i] - 3.0, 2 * M_PI);
  }
  const Eigen::Matrix3d root = covariance.llt().matrixL();
  const Eigen::MatrixX3d white = errors * root.inverse().transpose();
  EXPECT_TRUE(is_chi_square(white.squaredNorm(), 3.0 * kPopulation));
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT(std::abs(white.col(i).sum()), kOneInAMillion * std::sqrt(kPopulation));
    const double product = white.col(i).dot(white.col((i + 1) % 3));
    EXPECT_LT(std::abs(product), kOneInAMillion * std::sqrt(kPopulation));
    EXPECT_TRUE(is_chi_square(white.col(i).squaredNorm(), kPopulation));
  }
  EXPECT_LE(p.heading.abs().maxCoeff(), M_PI);
  expect_fresh_weights(filter);
}

TEST(Initialization, GaussianAtTheStartIsTheOneOfTheOptions) {
  BeaconMclOptions options = options_for(Initialization::gaussian);
  options.initialization.x = 7.0;
  options.initialization.y = 5.0;
  options.initialization.heading = -1.0;
  options.initialization.sigma_position = 2.0;
  options.initialization.sigma_heading = 0.1;
  BeaconMcl filter(options, square_of_beacons(), 1);
  ASSERT_TRUE(filter.is_initialized());
  EXPECT_TRUE(is_chi_square((filter.particles().x - 7.0).square().sum() / 4.0, kPopulation));
  EXPECT_TRUE(is_chi_square((filter.particles().y - 5.0).square().sum() / 4.0, kPopulation));
  EXPECT_TRUE(is_chi_square((filter.particles().heading + 1.0).square().sum() / 0.01, kPopulation));
}

// --- From the ranges -----------------------------------------------------------------------------

BeaconMclOptions exact_ranges() {
  BeaconMclOptions options = options_for(Initialization::from_ranges, 2000);
  options.calibration.estimation = CalibrationEstimation::off;
  options.ranges.sigma = 0.2;
  return options;
}

double distance_to(int beacon, const Pose2& pose) {
  const Eigen::Vector3d place = square_of_beacons()[static_cast<std::size_t>(beacon - 1)].position;
  return std::hypot(place.x() - pose.x, place.y() - pose.y);
}

TEST(Initialization, WaitsForDifferentBeacons) {
  BeaconMcl filter(exact_ranges(), square_of_beacons(), 1);
  const Pose2 truth{6.0, 13.0, 1.0};
  for (const int beacon : {1, 1, 3, 1, 3}) {
    filter.update({}, {range_of(beacon, distance_to(beacon, truth))});
    EXPECT_FALSE(filter.is_initialized());
  }
  filter.update({}, {range_of(4, distance_to(4, truth))});
  ASSERT_TRUE(filter.is_initialized());
  EXPECT_EQ(filter.particles().size(), 2000);
  expect_fresh_weights(filter);
}

// Three exact ranges of a standing robot: the place within three deviations of a trilateration,
// sigma sqrt(2) at the worst here, any heading. Headings by chi-square, which many copies of few
// candidates would make too large: so only their spread is looked at.
TEST(Initialization, ThreeRangesPlaceTheRobot) {
  const Pose2 truth{6.0, 13.0, 1.0};
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    BeaconMcl filter(exact_ranges(), square_of_beacons(), seed);
    for (const int beacon : {1, 2, 3}) {
      filter.update({}, {range_of(beacon, distance_to(beacon, truth))});
    }
    ASSERT_TRUE(filter.is_initialized());
    EXPECT_LT(position_error(filter, truth), 0.3) << seed;
    const Eigen::ArrayXd distance =
        ((filter.particles().x - truth.x).square() + (filter.particles().y - truth.y).square())
            .sqrt();
    EXPECT_GT((distance < 3.0 * 0.2 * std::sqrt(2.0)).cast<double>().mean(), 0.9) << seed;
    for (const double sector : {-0.75, -0.25, 0.25, 0.75}) {
      const Eigen::ArrayXd off = filter.particles().heading - sector * M_PI;
      EXPECT_GT((off.abs() < 0.25 * M_PI).cast<double>().mean(), 0.1) << seed;
    }
  }
}

// Two beacons leave two places, mirrored at the line between them; both have to be there.
TEST(Initialization, TwoBeaconsLeaveTwoPlaces) {
  BeaconMclOptions options = exact_ranges();
  options.initialization.beacons = 2;
  const std::vector<Beacon> beacons = {{1, {0.0, 0.0, 0.0}, true}, {2, {20.0, 0.0, 0.0}, true}};
  BeaconMcl filter(options, beacons, 2);
  filter.update({}, {range_of(1, 10.0), range_of(2, std::sqrt(260.0))});
  ASSERT_TRUE(filter.is_initialized());
  // (6, 8) and (6, -8).
  const BeaconMclParticles& p = filter.particles();
  const auto share_near = [&](double x, double y) {
    return (((p.x - x).square() + (p.y - y).square()).sqrt() < 1.2).cast<double>().mean();
  };
  EXPECT_GT(share_near(6.0, 8.0), 0.3);
  EXPECT_GT(share_near(6.0, -8.0), 0.3);
  EXPECT_GT(share_near(6.0, 8.0) + share_near(6.0, -8.0), 0.9);
}

// A range of a beacon alone: every place at that distance is as good as any other, up to the noise.
TEST(Initialization, OneBeaconLeavesARing) {
  BeaconMclOptions options = exact_ranges();
  options.initialization.beacons = 1;
  BeaconMcl filter(options, {{1, {5.0, 5.0, 3.0}, false}}, 2);
  filter.update({}, {range_of(1, 5.0, 0.01, {0.0, 0.0, -1.0})});
  ASSERT_TRUE(filter.is_initialized());
  const BeaconMclParticles& p = filter.particles();
  // Four metres of height between antenna and beacon leave three on the ground.
  const Eigen::ArrayXd radius = ((p.x - 5.0).square() + (p.y - 5.0).square()).sqrt();
  EXPECT_LT(std::abs(radius.mean() - 3.0), 0.05);
  EXPECT_LT((radius - 3.0).abs().maxCoeff(), 1.0);
  for (const double sign_x : {-1.0, 1.0}) {
    for (const double sign_y : {-1.0, 1.0}) {
      const double share =
          (sign_x * (p.x - 5.0) > 0.0 && sign_y * (p.y - 5.0) > 0.0).cast<double>().mean();
      EXPECT_NEAR(share, 0.25, 0.1);
    }
  }
}

// The robot drives between the ranges: dead reckoning tells where they were taken, and with that
// also which way it looks.
TEST(Initialization, RangesOnTheWayAreBroughtTogether) {
  BeaconMclOptions options = exact_ranges();
  options.initialization.beacons = 4;
  options.ranges.sigma = 0.05;
  int right = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    BeaconMcl filter(options, square_of_beacons(), seed);
    Pose2 truth{6.0, 5.0, 1.0};
    for (const int beacon : {1, 2, 3, 1, 2, 3, 1, 2, 3, 4}) {
      const Pose2 step{1.0, 0.0, 0.0};
      truth = compose(truth, step);
      filter.update(step_of(options.odometry, step, 0.4),
                    {range_of(beacon, distance_to(beacon, truth))});
    }
    ASSERT_TRUE(filter.is_initialized());
    const PoseEstimate estimate = filter.estimate();
    right += position_error(filter, truth) < 0.5 &&
             std::abs(std::remainder(estimate.mean.heading - truth.heading, 2 * M_PI)) < 0.2;
  }
  EXPECT_EQ(right, 5);
}

// After `patience` it starts with what there is, at whatever rate the ranges come.
TEST(Initialization, PatienceEnds) {
  for (const double rate : {0.5, 2.0, 10.0, 50.0}) {
    for (const double patience : {2.0, 5.0, 10.0}) {
      BeaconMclOptions options = exact_ranges();
      options.initialization.patience = patience;
      BeaconMcl filter(options, square_of_beacons(), 1);
      const double period = 1.0 / rate;
      double first = -1.0;
      double time = 0.0;
      while (!filter.is_initialized() && time < 30.0) {
        time += period;
        if (first < 0.0) first = time;
        filter.update(step_of(options.odometry, {}, period), {range_of(1, 9.0)});
      }
      EXPECT_NEAR(time - first, patience, 2.1 * period) << rate << " Hz, " << patience << " s";
    }
  }
}

// Silence counts as well: the one range there is does not get better by waiting.
TEST(Initialization, PatienceEndsWithoutFurtherRanges) {
  BeaconMclOptions options = exact_ranges();
  BeaconMcl filter(options, square_of_beacons(), 1);
  filter.update(step_of(options.odometry, {}, 0.1), {range_of(1, 9.0)});
  for (int i = 0; i < 49; ++i) filter.update(step_of(options.odometry, {}, 0.1), {});
  EXPECT_FALSE(filter.is_initialized());
  for (int i = 0; i < 3; ++i) filter.update(step_of(options.odometry, {}, 0.1), {});
  EXPECT_TRUE(filter.is_initialized());
}

// A nominal calibration is taken out of the ranges that place the particles.
TEST(Initialization, RangesAreCorrectedByTheGivenCalibration) {
  BeaconMcl filter(exact_ranges(), square_of_beacons(), 3, {{-1, {1.2, 0.5, 0.0}}});
  const Pose2 truth{6.0, 13.0, 1.0};
  for (const int beacon : {1, 2, 3}) {
    filter.update({}, {range_of(beacon, 1.2 * distance_to(beacon, truth) + 0.5)});
  }
  EXPECT_LT(position_error(filter, truth), 0.3);
  EXPECT_NEAR(filter.corrected_range(1, 12.5), 10.0, 1e-12);
}

// Where the calibration is not known the ring is as wide as that allows: scale 1 +- 0.05 at 20 m,
// bias +- 0.5 m and noise 0.3 m are 1.158 m in all. Mean and variance of 2000 radii beyond 4.89
// deviations: false alarm 2e-6.
TEST(Initialization, UnknownCalibrationWidensTheRing) {
  BeaconMclOptions options = exact_ranges();
  options.initialization.beacons = 1;
  options.ranges.sigma = 0.3;
  options.calibration.estimation = CalibrationEstimation::shared;
  options.calibration.scale_sigma = 0.05;
  options.calibration.bias_sigma = 0.5;
  BeaconMcl filter(options, {{1, {5.0, 5.0, 0.0}, true}}, 2);
  filter.update({}, {range_of(1, 20.0)});
  const BeaconMclParticles& p = filter.particles();
  const Eigen::ArrayXd radius = ((p.x - 5.0).square() + (p.y - 5.0).square()).sqrt();
  const double sigma = std::sqrt(1.0 + 0.25 + 0.09);
  EXPECT_LT(std::abs(radius.mean() - 20.0), kOneInAMillion * sigma / std::sqrt(2000.0));
  EXPECT_TRUE(is_chi_square((radius - 20.0).square().sum() / (sigma * sigma), 2000.0));
}

// --- Starting again ------------------------------------------------------------------------------

BeaconMcl experienced(Initialization method) {
  BeaconMclOptions options = options_for(method, 500);
  options.initialization.x = options.initialization.y = 8.0;
  const World world = circle_among_six_beacons(1.05, 0.2, 40.0);
  BeaconMcl filter(options, beacons_of(world), 1);
  run_drive(simulate(world, 1), &filter, [](double, const Pose2&) {});
  return filter;
}

TEST(Initialization, StartingAgainKeepsWhatIsKnownOfCalibrationAndBias) {
  for (const bool globally : {true, false}) {
    BeaconMcl filter = experienced(Initialization::from_ranges);
    const CalibrationEstimate before = filter.calibration().front();
    const double bias_sigma = filter.yaw_rate_bias().sigma;
    ASSERT_LT(before.scale_sigma, 0.04);
    if (globally) {
      filter.global_localization();
    } else {
      filter.initialize_gaussian({3.0, 3.0, 0.0}, Eigen::Matrix3d::Identity());
    }
    expect_fresh_weights(filter);
    const CalibrationEstimate after = filter.calibration().front();
    EXPECT_NEAR(after.scale, before.scale, before.scale_sigma);
    EXPECT_LT(after.scale_sigma, 1.2 * before.scale_sigma);
    EXPECT_LT(filter.yaw_rate_bias().sigma, 1.2 * bias_sigma);
  }
}

TEST(Initialization, GlobalLocalizationSpreadsOverTheAreaOrTheRanges) {
  BeaconMcl over_area = experienced(Initialization::uniform);
  over_area.global_localization();
  EXPECT_GT(over_area.estimate().covariance(0, 0), 60.0);
  BeaconMcl from_ranges = experienced(Initialization::from_ranges);
  from_ranges.global_localization();
  // Places that fit the last seconds' ranges: about the robot.
  const World world = circle_among_six_beacons(1.05, 0.2, 40.0);
  EXPECT_LT(position_error(from_ranges, simulate(world, 1).odometry.back().truth), 1.5);
}

TEST(Initialization, GlobalLocalizationWithoutAnyRangesIsOverTheArea) {
  BeaconMcl filter(options_for(Initialization::from_ranges), square_of_beacons(), 1);
  filter.global_localization();
  ASSERT_TRUE(filter.is_initialized());
  expect_fresh_weights(filter);
  const double margin = 0.2 * 20.0 * std::sqrt(2.0);
  EXPECT_TRUE(is_uniform(filter.particles().x, -margin, 20.0 + margin));
}

}  // namespace
}  // namespace pf_resampling
