#include "pf_resampling_core/simulation/sensors.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pf_resampling_core/test/simulation/chi_square.hpp"

namespace pf_resampling {
namespace {

constexpr int kCount = 20000;

double square(double value) {
  return value * value;
}

TEST(SimulatedOdometry, WithoutErrorsIntegratesBackToTheTruth) {
  SimulatedOdometry odometry(OdometryErrors(), 0.1, 1);
  const Pose2 start{3.0, -2.0, 2.0};
  Pose2 truth = start;
  for (std::uint32_t step = 0; step < 1000; ++step) {
    const Control control{1.0 + 0.5 * std::sin(0.1 * step), std::cos(0.05 * step)};
    truth = compose(truth, arc_motion(control.speed, 0.0, control.yaw_rate, 0.1));
    odometry.advance(control, step);
    const Pose2 reckoned = compose(start, odometry.pose());
    ASSERT_NEAR(reckoned.x, truth.x, 1e-10);
    ASSERT_NEAR(reckoned.y, truth.y, 1e-10);
    ASSERT_NEAR(wrap_angle(reckoned.heading - truth.heading), 0.0, 1e-10);
  }
}

TEST(SimulatedOdometry, ScaleAndBiasBendTheCircle) {
  OdometryErrors errors;
  errors.distance_scale = 1.02;
  errors.yaw_scale = 0.99;
  errors.yaw_rate_bias = 0.001;
  SimulatedOdometry odometry(errors, 0.1, 1);
  for (std::uint32_t step = 0; step < 500; ++step) odometry.advance({1.0, 0.1}, step);
  // Closed form: a circle of radius v / w with the measured speed and yaw rate.
  const double yaw_rate = 0.99 * 0.1 + 0.001;
  const double radius = 1.02 / yaw_rate;
  EXPECT_NEAR(odometry.pose().x, radius * std::sin(50.0 * yaw_rate), 1e-10);
  EXPECT_NEAR(odometry.pose().y, radius * (1.0 - std::cos(50.0 * yaw_rate)), 1e-10);
}

// Six statistics, each with a false alarm of 1e-6: together 6e-6.
TEST(SimulatedOdometry, NoiseHasTheStatedMeanAndVariance) {
  OdometryErrors errors;
  errors.speed_sigma = 0.1;
  errors.yaw_rate_sigma = 0.02;
  errors.yaw_rate_bias = 0.005;
  errors.lateral_sigma = 0.05;
  SimulatedOdometry odometry(errors, 0.1, 7);
  const Control control{1.0, 0.2};
  Eigen::Array3d sum = Eigen::Array3d::Zero();
  Eigen::Array3d squares = Eigen::Array3d::Zero();
  for (std::uint32_t step = 0; step < kCount; ++step) {
    const Pose2 before = odometry.pose();
    odometry.advance(control, step);
    const Control& measured = odometry.measured();
    const Pose2 sideways = relative(
        compose(before, arc_motion(measured.speed, 0.0, measured.yaw_rate, 0.1)), odometry.pose());
    // The sideways motion is seen from the heading at the end; its length is all of it, up to the
    // curvature of so short an arc.
    const Eigen::Array3d normals(
        (measured.speed - 1.0) / 0.1, (measured.yaw_rate - 0.205) / 0.02,
        std::copysign(std::hypot(sideways.x, sideways.y), sideways.y) / (0.05 * 0.1));
    sum += normals;
    squares += normals.square();
  }
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT(std::abs(sum[i]) / std::sqrt(kCount), kOneInAMillion) << i;
    EXPECT_TRUE(is_chi_square(squares[i], kCount)) << i;
  }
}

// False alarm 1e-6: steps of the bias are independent normals of variance drift^2 * period.
TEST(SimulatedOdometry, BiasOfTheYawRateWalks) {
  OdometryErrors errors;
  errors.yaw_rate_bias = 0.01;
  errors.yaw_rate_bias_drift = 0.002;
  SimulatedOdometry odometry(errors, 0.25, 3);
  odometry.advance({1.0, 0.0}, 0);
  EXPECT_DOUBLE_EQ(odometry.measured().yaw_rate, 0.01);
  double previous = odometry.measured().yaw_rate;
  double squares = 0.0;
  for (std::uint32_t step = 1; step <= kCount; ++step) {
    odometry.advance({1.0, 0.0}, step);
    squares += square((odometry.measured().yaw_rate - previous) / (0.002 * 0.5));
    previous = odometry.measured().yaw_rate;
  }
  EXPECT_TRUE(is_chi_square(squares, kCount)) << squares;
}

TEST(MeasureRange, WithoutErrorsIsTheDistanceInSpace) {
  RangeSensorOptions options;
  options.antenna = {0.5, 0.0, 1.0};
  SimulatedBeacon beacon;
  beacon.beacon.position = {4.0, 5.5, 13.0};
  // Heading 90 degrees: the antenna is at (1, 2.5, 1), the beacon (3, 3, 12) away.
  const Pose2 pose{1.0, 2.0, kPi / 2.0};
  EXPECT_NEAR(*measure_range(options, beacon, pose, 1, 1), std::sqrt(9.0 + 9.0 + 144.0), 1e-12);
}

TEST(MeasureRange, NothingFromBeyondReach) {
  RangeSensorOptions options;
  options.range_max = 5.0;
  SimulatedBeacon beacon;
  beacon.errors.scale = 1.5;  // reach is a matter of the true distance
  beacon.beacon.position = {4.9, 0.0, 0.0};
  EXPECT_TRUE(measure_range(options, beacon, Pose2(), 1, 1));
  beacon.beacon.position = {5.1, 0.0, 0.0};
  EXPECT_FALSE(measure_range(options, beacon, Pose2(), 1, 1));
}

// Two statistics, each with a false alarm of 1e-6.
TEST(MeasureRange, ScaleBiasAndNoiseAreTheStatedOnes) {
  SimulatedBeacon beacon;
  beacon.beacon.position = {20.0, 0.0, 0.0};
  beacon.errors = {1.05, -0.3, 0.4};
  double sum = 0.0, squares = 0.0;
  for (std::uint32_t i = 1; i <= kCount; ++i) {
    const double range = *measure_range(RangeSensorOptions(), beacon, Pose2(), 11, i);
    const double residual = (range - (1.05 * 20.0 - 0.3)) / 0.4;
    sum += residual, squares += square(residual);
  }
  EXPECT_LT(std::abs(sum) / std::sqrt(kCount), kOneInAMillion);
  EXPECT_TRUE(is_chi_square(squares, kCount)) << squares;
}

// Share, mean and distribution over ten bins, each with a false alarm of about 1e-6.
TEST(MeasureRange, OutliersAreUniformAndAsManyAsStated) {
  RangeSensorOptions options;
  options.outlier_share = 0.1;
  options.outlier_max = 50.0;
  SimulatedBeacon beacon;
  beacon.beacon.position = {200.0, 0.0, 0.0};  // so that outliers are told from the rest
  beacon.errors.sigma = 1.0;
  double bins[10] = {};
  double outliers = 0.0;
  for (std::uint32_t i = 1; i <= kCount; ++i) {
    const double range = *measure_range(options, beacon, Pose2(), 5, i);
    if (range > 100.0) continue;
    ASSERT_GE(range, 0.0);
    ASSERT_LT(range, 50.0);
    outliers += 1.0;
    bins[static_cast<int>(range / 5.0)] += 1.0;
  }
  const double expected = 0.1 * kCount;
  EXPECT_LT(std::abs(outliers - expected) / std::sqrt(expected * 0.9), kOneInAMillion);
  double chi_square = 0.0;
  for (const double bin : bins) chi_square += square(bin - outliers / 10.0) / (outliers / 10.0);
  EXPECT_LT(chi_square, 46.1);  // chi-square with 9 degrees of freedom, upper 6e-7
}

// Share and mean, each with a false alarm of 1e-6 (the mean of 2000 exponentials is near normal;
// 6 standard deviations leave room for its skewness).
TEST(MeasureRange, ReflectedRangesAreTooLongByAnExponential) {
  RangeSensorOptions options;
  options.reflected_share = 0.1;
  options.reflected_excess_mean = 3.0;
  SimulatedBeacon beacon;
  beacon.beacon.position = {20.0, 0.0, 0.0};
  double reflected = 0.0, sum = 0.0;
  for (std::uint32_t i = 1; i <= kCount; ++i) {
    const double range = *measure_range(options, beacon, Pose2(), 5, i);
    ASSERT_GE(range, 20.0);
    if (range == 20.0) continue;
    reflected += 1.0;
    sum += range - 20.0;
  }
  EXPECT_LT(std::abs(reflected - 0.1 * kCount) / std::sqrt(0.09 * kCount), kOneInAMillion);
  EXPECT_LT(std::abs(sum / reflected - 3.0), 6.0 * 3.0 / std::sqrt(reflected));
}

TEST(ObserveLandmarks, SeesWhatIsWithinReachAndView) {
  SimulatedLandmarkSensor options;
  options.range_max = 5.0;
  const std::vector<Eigen::Vector2d> landmarks = {
      {1.0, 5.0}, {1.0, 7.1}, {4.0, 1.1}, {4.0, 0.9}, {-1.5, 1.1}};
  // At (1, 1), looking along y: the view of 180 degrees is the half-plane y > 1.
  const auto seen = observe_landmarks(options, landmarks, {1.0, 1.0, kPi / 2.0}, 1, 1);
  ASSERT_EQ(seen.size(), 3u);
  EXPECT_EQ(seen[0].id, 0);
  EXPECT_NEAR(seen[0].range, 4.0, 1e-12);
  EXPECT_NEAR(seen[0].bearing, 0.0, 1e-12);
  EXPECT_EQ(seen[1].id, 2);
  EXPECT_NEAR(seen[1].bearing, std::atan2(-3.0, 0.1), 1e-12);
  EXPECT_EQ(seen[2].id, 4);
  EXPECT_GT(seen[2].bearing, 0.0);  // on the left
}

// Two statistics, each with a false alarm of 1e-6.
TEST(ObserveLandmarks, NoiseIsTheStatedOne) {
  SimulatedLandmarkSensor options;
  options.range_max = 10.0;
  options.range_sigma = 0.1;
  options.bearing_sigma = 0.02;
  double range_squares = 0.0, bearing_squares = 0.0;
  for (std::uint32_t scan = 1; scan <= kCount / 2; ++scan) {
    const auto seen = observe_landmarks(options, {{3.0, 4.0}, {5.0, 0.0}}, Pose2(), 9, scan);
    ASSERT_EQ(seen.size(), 2u);
    range_squares += square((seen[0].range - 5.0) / 0.1) + square((seen[1].range - 5.0) / 0.1);
    bearing_squares +=
        square((seen[0].bearing - std::atan2(4.0, 3.0)) / 0.02) + square(seen[1].bearing / 0.02);
  }
  EXPECT_TRUE(is_chi_square(range_squares, kCount)) << range_squares;
  EXPECT_TRUE(is_chi_square(bearing_squares, kCount)) << bearing_squares;
}

}  // namespace
}  // namespace pf_resampling
