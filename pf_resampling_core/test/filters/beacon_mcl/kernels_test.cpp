#include "pf_resampling_core/filters/beacon_mcl/kernels.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <vector>

#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

// Not a multiple of any vector width.
constexpr int kCount = 37;

constexpr kernels::Weighing kWeighing = {1.0, 0.9, true, true};

struct Particles {
  std::vector<double> x, y, heading, scale, bias, scale_variance, covariance, bias_variance,
      log_weight, innovation, innovation_variance, inlier;

  Particles() {
    const RandomStream stream(31, RandomPurpose::test, 0);
    for (std::uint64_t i = 0; i < kCount; ++i) {
      const std::uint64_t k = 16 * i;
      x.push_back(10.0 + 3.0 * stream.normal(k));
      y.push_back(-4.0 + 3.0 * stream.normal(k + 1));
      heading.push_back(M_PI * (2.0 * stream.uniform(k + 2) - 1.0));
      scale.push_back(1.0 + 0.05 * stream.normal(k + 4));
      bias.push_back(0.5 * stream.normal(k + 5));
      const double ss = 1e-4 + 2e-3 * stream.uniform(k + 6);
      const double bb = 1e-2 + 0.3 * stream.uniform(k + 7);
      scale_variance.push_back(ss);
      bias_variance.push_back(bb);
      covariance.push_back(0.9 * (2.0 * stream.uniform(k + 8) - 1.0) * std::sqrt(ss * bb));
      log_weight.push_back(stream.normal(k + 10));
    }
    innovation.resize(kCount);
    innovation_variance.resize(kCount);
    inlier.resize(kCount);
  }

  // All at once; what is summed up, particle by particle.
  void weigh(const kernels::Range& range) {
    Particles alone = *this;
    for (std::size_t i = 0; i < kCount; ++i) {
      const kernels::RangeSums sums = alone.take_in({range}, i, 1);
      innovation[i] = sums.innovation;
      innovation_variance[i] = sums.innovation_square - sums.innovation * sums.innovation;
      inlier[i] = sums.noise_count / sums.likelihood[0];
    }
    take_in({range}, 0, kCount);
    EXPECT_EQ(log_weight, alone.log_weight);
    EXPECT_EQ(scale, alone.scale);
    EXPECT_EQ(bias_variance, alone.bias_variance);
  }

  using Weigh = decltype(kernels::weigh);
  kernels::RangeSums take_in(const std::vector<kernels::Range>& ranges, std::size_t first,
                             std::int64_t count, const kernels::Weighing& weighing = kWeighing,
                             Weigh* by = kernels::weigh) {
    kernels::RangeSums sums{};
    by(weighing, ranges.data(), static_cast<int>(ranges.size()), count, &x[first], &y[first],
       &heading[first], std::vector<double>(kCount, 1.0).data(),
       {&scale[first], &bias[first], &scale_variance[first], &covariance[first],
        &bias_variance[first]},
       &log_weight[first], &sums);
    return sums;
  }
};

kernels::Range plain_range(double range) {
  kernels::Range r{};
  r.range = range;
  r.beacon[0] = 2.0;
  r.beacon[1] = 7.0;
  r.beacon[2] = 3.5;
  r.antenna[2] = 0.5;
  r.variance = 0.3;
  r.nominal = 0.2;
  r.inlier_share = 1.0;
  return r;
}

// With an outlier floor, a lever arm and a random walk.
kernels::Range full_range(double range) {
  kernels::Range r = plain_range(range);
  r.antenna[0] = 0.4;
  r.antenna[1] = -0.3;
  r.inlier_share = 0.95;
  r.floor_density = 0.05 / 200.0;
  r.scale_walk = 3e-5;
  r.bias_walk = 2e-3;
  return r;
}

double distance_of(const kernels::Range& range, double x, double y, double heading) {
  const Eigen::Rotation2Dd turn(heading);
  const Eigen::Vector2d antenna =
      Eigen::Vector2d(x, y) + turn * Eigen::Vector2d(range.antenna[0], range.antenna[1]);
  return Eigen::Vector3d(range.beacon[0] - antenna.x(), range.beacon[1] - antenna.y(),
                         range.beacon[2] - range.antenna[2])
      .norm();
}

double normal_density(double deviation, double variance) {
  return std::exp(-0.5 * deviation * deviation / variance) / std::sqrt(2.0 * M_PI * variance);
}

struct Mixture {
  double likelihood;
  double inlier;
};

// The likelihood of a range, RangeModelOptions: a Gaussian, plus a uniform floor.
Mixture mixture(const kernels::Range& range, double innovation, double variance) {
  const double gaussian = range.inlier_share * normal_density(innovation, variance);
  const double total = gaussian + range.floor_density;
  return {total, gaussian / total};
}

// The Kalman filter for (scale, bias) in matrices, then the moments of the mixture of the range
// being taken in and being none of its business.
void expect_calibrating_update(const kernels::Range& range) {
  const Particles before;
  Particles after;
  after.weigh(range);
  for (std::size_t i = 0; i < kCount; ++i) {
    SCOPED_TRACE(i);
    const double distance = distance_of(range, before.x[i], before.y[i], before.heading[i]);
    const Eigen::RowVector2d row(distance, 1.0);
    const Eigen::Vector2d mean(before.scale[i], before.bias[i]);
    Eigen::Matrix2d prior;
    prior << before.scale_variance[i] + range.scale_walk, before.covariance[i],
        before.covariance[i], before.bias_variance[i] + range.bias_walk;
    const double innovation = range.range - row * mean;
    const double variance = row * prior * row.transpose() + range.variance;
    const Mixture m = mixture(range, innovation, variance);
    const Eigen::Vector2d gain = prior * row.transpose() / variance;
    const Eigen::Matrix2d taken_in = prior - gain * variance * gain.transpose();
    const Eigen::Vector2d shift = gain * innovation;
    const Eigen::Vector2d expected_mean = mean + m.inlier * shift;
    const Eigen::Matrix2d expected = m.inlier * taken_in + (1.0 - m.inlier) * prior +
                                     m.inlier * (1.0 - m.inlier) * shift * shift.transpose();

    EXPECT_NEAR(after.log_weight[i], before.log_weight[i] + std::log(m.likelihood), 1e-9);
    EXPECT_NEAR(after.innovation[i], innovation, 1e-11);
    EXPECT_NEAR(after.innovation_variance[i], variance, 1e-12);
    EXPECT_NEAR(after.inlier[i], m.inlier, 2e-10);
    EXPECT_NEAR(after.scale[i], expected_mean[0], 1e-10);
    EXPECT_NEAR(after.bias[i], expected_mean[1], 1e-10);
    EXPECT_NEAR(after.scale_variance[i], expected(0, 0), 1e-12);
    EXPECT_NEAR(after.covariance[i], expected(0, 1), 1e-11);
    EXPECT_NEAR(after.bias_variance[i], expected(1, 1), 1e-10);
  }
}

TEST(Weigh, CalibrationIsAKalmanFilterThatTakesInAsMuchAsIsBelieved) {
  expect_calibrating_update(plain_range(14.0));
  // From clear inliers over doubtful to clear outliers, on both sides.
  for (const double range : {2.0, 11.0, 14.0, 17.0, 19.0, 40.0}) {
    SCOPED_TRACE(range);
    expect_calibrating_update(full_range(range));
  }
}

// However absurd a range is: nothing becomes non-finite, and what is taken for an outlier leaves
// the calibration alone.
TEST(Weigh, AbsurdRangesLeaveTheCalibrationAlone) {
  for (const double absurd : {1e3, 1e6, 1e12}) {
    for (const kernels::Range& range : {full_range(absurd), plain_range(absurd)}) {
      const Particles before;
      Particles after;
      after.weigh(range);
      for (std::size_t i = 0; i < kCount; ++i) {
        SCOPED_TRACE(testing::Message() << "range " << absurd << ", particle " << i);
        ASSERT_TRUE(std::isfinite(after.log_weight[i]));
        EXPECT_EQ(after.scale[i], before.scale[i]);
        EXPECT_EQ(after.bias[i], before.bias[i]);
        EXPECT_EQ(after.scale_variance[i], before.scale_variance[i] + range.scale_walk);
        EXPECT_EQ(after.covariance[i], before.covariance[i]);
        EXPECT_EQ(after.bias_variance[i], before.bias_variance[i] + range.bias_walk);
      }
    }
  }
}

TEST(Weigh, AParticleAtTheBeacon) {
  Particles p;
  p.x[3] = 2.0;
  p.y[3] = 7.0;
  kernels::Range range = plain_range(0.4);
  range.beacon[2] = range.antenna[2];
  p.weigh(range);
  EXPECT_TRUE(std::isfinite(p.log_weight[3]));
  EXPECT_NEAR(p.innovation[3], 0.4 - Particles().bias[3], 1e-15);
}

// Motion.

OdometryIncrement bent_increment() {
  OdometryNoise noise;
  noise.heading_per_distance = 0.03;
  OdometryIncrement increment;
  for (int i = 0; i < 10; ++i) append(noise, {0.3, 0.02, 0.05}, 0.2, &increment);
  return increment;
}

struct Moving {
  std::vector<double> x, y, heading, bias, bias_variance, translation, turning;
  explicit Moving(std::size_t count, double bias_mean, double variance)
      : x(count, 5.0),
        y(count, -2.0),
        heading(count, 2.5),
        bias(count, bias_mean),
        bias_variance(count, variance),
        translation(count, 1.0),
        turning(count, 1.0) {}

  kernels::MovingParticles view() {
    return {x.data(),           y.data(),      heading.data(), bias.data(), bias_variance.data(),
            translation.data(), turning.data()};
  }
};

// Word by word: the bias is drawn from its filter, the noise from the covariance with the given
// factors on its heading and its other part, the motion composed, and the scalar Kalman filter of
// the bias told the turn that came out.
TEST(Move, IsTheDefinition) {
  const OdometryIncrement increment = bent_increment();
  constexpr double kWalk = 1e-3;
  Eigen::Matrix3d heading_first;
  const int order[3] = {2, 0, 1};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) heading_first(i, j) = increment.covariance(order[i], order[j]);
  }
  const Eigen::Matrix3d root = heading_first.llt().matrixL();

  const std::size_t count = kCount;
  Moving p(count, 0.01, 4e-4);
  std::vector<float> z[4];
  for (auto& part : z) part.resize(count);
  RandomStream(37, RandomPurpose::test, 0)
      .fill_single_normal4(0, kCount, z[0].data(), z[1].data(), z[2].data(), z[3].data());
  for (std::size_t i = 0; i < count; ++i) {
    p.x[i] += 0.1 * static_cast<double>(i);
    p.heading[i] = std::remainder(0.3 * static_cast<double>(i), 2 * M_PI);
    p.translation[i] = 0.5 + 0.05 * static_cast<double>(i);
    p.turning[i] = 2.0 - 0.04 * static_cast<double>(i);
  }
  const Moving before = p;
  kernels::move(kernels::make_motion(increment, kWalk), kCount, z[0].data(), z[1].data(),
                z[2].data(), z[3].data(), p.view());

  for (std::size_t i = 0; i < count; ++i) {
    SCOPED_TRACE(i);
    const double bias = before.bias[i] + 0.02 * double{z[3][i]};
    const Eigen::Vector3d noise = root * Eigen::Vector3d(before.turning[i] * double{z[2][i]},
                                                         before.translation[i] * double{z[0][i]},
                                                         before.translation[i] * double{z[1][i]});
    const Eigen::Vector3d& s = increment.yaw_rate_sensitivity;
    const double turn = noise[0] - s[2] * bias;
    const Pose2 motion{increment.mean.x - s[0] * bias + noise[1],
                       increment.mean.y - s[1] * bias + noise[2], increment.mean.heading + turn};
    const Pose2 expected = compose({before.x[i], before.y[i], before.heading[i]}, motion);
    EXPECT_NEAR(p.x[i], expected.x, 1e-12);
    EXPECT_NEAR(p.y[i], expected.y, 1e-12);
    EXPECT_NEAR(std::remainder(p.heading[i] - expected.heading, 2 * M_PI), 0.0, 1e-12);
    EXPECT_LE(std::abs(p.heading[i]), M_PI + 1e-15);

    // Information form: prior and one observation, -s bias, of variance r.
    const double r = increment.covariance(2, 2) * before.turning[i] * before.turning[i];
    const double information = 1.0 / 4e-4 + s[2] * s[2] / r;
    const double mean = (before.bias[i] / 4e-4 - s[2] * turn / r) / information;
    EXPECT_NEAR(p.bias[i], mean, 1e-12);
    EXPECT_NEAR(p.bias_variance[i], 1.0 / information + kWalk * kWalk * increment.duration, 1e-15);
  }
}

// Dead reckoning without noise and with a bias that is not known: the turn that was drawn tells it.
TEST(Move, WithoutHeadingNoiseTheDrawIsTheBias) {
  OdometryNoise none;
  none.translation_per_distance = none.slip_per_distance = none.heading_per_distance = 0.0;
  none.heading_per_angle = none.heading_per_time = none.translation_per_time = 0.0;
  OdometryIncrement increment;
  append(none, {1.0, 0.0, 0.0}, 2.0, &increment);
  Moving p(1, 0.0, 0.01);
  const float z0 = 0.3f, z1 = -0.4f, z2 = 1.1f, z3 = 0.5f;
  kernels::move(kernels::make_motion(increment, 0.0), 1, &z0, &z1, &z2, &z3, p.view());
  EXPECT_NEAR(p.bias[0], 0.05, 1e-15);
  EXPECT_NEAR(p.bias_variance[0], 0.0, 1e-17);
  EXPECT_NEAR(p.heading[0], 2.5 - 0.1, 1e-14);
}

// Of three ranges, one after the other: what is known of the single ones.
TEST(Weigh, SumsAreThoseOfTheSingleRanges) {
  const std::vector<kernels::Range> ranges = {full_range(14.0), plain_range(12.0),
                                              full_range(17.0)};
  constexpr double kTempering = 0.25;
  kernels::RangeSums expected{};
  Particles single;
  std::vector<double> likelihood(kCount, 1.0), squares(kCount, 0.0), count(kCount, 0.0);
  for (std::size_t k = 0; k < ranges.size(); ++k) {
    const Particles before = single;
    single.weigh(ranges[k]);
    expected.innovation = expected.innovation_square = 0.0;
    for (std::size_t i = 0; i < kCount; ++i) {
      const double innovation = single.innovation[i];
      const double s = single.innovation_variance[i];
      expected.innovation += likelihood[i] * innovation;
      expected.innovation_square += likelihood[i] * (innovation * innovation + s);
      likelihood[i] *= std::exp(single.log_weight[i] - before.log_weight[i]);
      expected.likelihood[k] += likelihood[i];
      // Innovation = noise + prediction error, independent: the noise given their sum is normal
      // with mean R/S times it and variance R (S - R) / S.
      const double r = ranges[k].variance;
      const double mean = r / s * innovation;
      squares[i] =
          0.9 * squares[i] + single.inlier[i] * (mean * mean + r * (s - r) / s) / ranges[k].nominal;
      count[i] = 0.9 * count[i] + single.inlier[i];
    }
  }
  for (std::size_t i = 0; i < kCount; ++i) {
    expected.noise_squares += likelihood[i] * squares[i];
    expected.noise_count += likelihood[i] * count[i];
  }
  Particles together;
  kernels::Weighing weighing = kWeighing;
  weighing.tempering = kTempering;
  const kernels::RangeSums sums = together.take_in(ranges, 0, kCount, weighing);
  for (std::size_t k = 0; k < ranges.size(); ++k) {
    EXPECT_NEAR(sums.likelihood[k] / expected.likelihood[k], 1.0, 1e-11);
  }
  EXPECT_NEAR(sums.innovation / expected.innovation, 1.0, 1e-11);
  EXPECT_NEAR(sums.innovation_square / expected.innovation_square, 1.0, 1e-11);
  EXPECT_NEAR(sums.noise_squares / expected.noise_squares, 1.0, 1e-10);
  EXPECT_NEAR(sums.noise_count / expected.noise_count, 1.0, 1e-10);
  EXPECT_EQ(together.scale, single.scale);
  EXPECT_EQ(together.scale_variance, single.scale_variance);
  for (std::size_t i = 0; i < kCount; ++i) {
    EXPECT_NEAR(together.log_weight[i],
                Particles().log_weight[i] + kTempering * std::log(likelihood[i]), 1e-12);
  }
}

// Where nothing is calibrated, it is as if the calibration were known exactly.
TEST(Weigh, WithoutCalibrationItIsAsKnown) {
  Particles known;
  for (std::size_t i = 0; i < kCount; ++i) {
    known.scale_variance[i] = known.covariance[i] = known.bias_variance[i] = 0.0;
  }
  const Particles before = known;
  Particles uncalibrated = known;
  const std::vector<kernels::Range> ranges = {plain_range(14.0), plain_range(12.0)};
  const kernels::RangeSums sums = known.take_in(ranges, 0, kCount);
  for (const bool learns : {true, false}) {
    Particles p = before;
    const kernels::RangeSums same = p.take_in(ranges, 0, kCount, {1.0, 0.9, false, learns});
    EXPECT_EQ(p.log_weight, known.log_weight);
    EXPECT_EQ(p.scale, before.scale);
    EXPECT_EQ(same.likelihood[1], sums.likelihood[1]);
    EXPECT_EQ(same.noise_squares, learns ? sums.noise_squares : 0.0);
  }
}

}  // namespace

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(PF_RESAMPLING_NO_CLONES)
// Those that kernels::weigh() and kernels::move() choose from.
namespace kernels {
using Move = void(const Motion&, std::int64_t, const float*, const float*, const float*,
                  const float*, double*, double*, double*, double*, double*, const double*,
                  const double*);
decltype(weigh) weigh_16, weigh_32, weigh_64;
Move move_columns_16, move_columns_32, move_columns_64;
}  // namespace kernels

namespace {

TEST(VectorWidth, GivesTheSameBytes) {
  constexpr std::int64_t kMany = 37;
  struct Width {
    const char* name;
    bool is_there;
    decltype(kernels::weigh)* weigh;
    kernels::Move* move;
  };
  const Width widths[] = {
      {"SSE2", true, kernels::weigh_16, kernels::move_columns_16},
      {"AVX2", __builtin_cpu_supports("avx2") != 0, kernels::weigh_32, kernels::move_columns_32},
      {"AVX-512", __builtin_cpu_supports("avx512f") != 0, kernels::weigh_64,
       kernels::move_columns_64}};
  std::vector<float> z[4];
  for (auto& part : z) part.resize(kMany);
  RandomStream(37, RandomPurpose::test, 0)
      .fill_single_normal4(0, kMany, z[0].data(), z[1].data(), z[2].data(), z[3].data());
  const kernels::Motion motion = kernels::make_motion(bent_increment(), 1e-3);
  const std::vector<kernels::Range> ranges = {full_range(14.0), plain_range(12.0), full_range(1e6)};
  for (const bool calibrates : {true, false}) {
    Particles first;
    Moving first_moving(kMany, 0.01, 4e-4);
    kernels::RangeSums first_sums{};
    for (const Width& width : widths) {
      if (!width.is_there) continue;
      SCOPED_TRACE(width.name);
      Particles p;
      const kernels::RangeSums sums =
          p.take_in(ranges, 0, kMany, {1.0, 0.9, calibrates, true}, width.weigh);
      Moving moving(kMany, 0.01, 4e-4);
      const kernels::MovingParticles m = moving.view();
      width.move(motion, kMany, z[0].data(), z[1].data(), z[2].data(), z[3].data(), m.x, m.y,
                 m.heading, m.yaw_rate_bias, m.yaw_rate_bias_variance, m.translation_factor,
                 m.heading_factor);
      if (&width == widths) {
        first = p;
        first_sums = sums;
        first_moving = moving;
      }
      EXPECT_EQ(std::memcmp(&sums, &first_sums, sizeof sums), 0);
      EXPECT_EQ(p.log_weight, first.log_weight);
      EXPECT_EQ(p.scale, first.scale);
      EXPECT_EQ(p.bias, first.bias);
      EXPECT_EQ(p.scale_variance, first.scale_variance);
      EXPECT_EQ(p.covariance, first.covariance);
      EXPECT_EQ(p.bias_variance, first.bias_variance);
      EXPECT_EQ(moving.x, first_moving.x);
      EXPECT_EQ(moving.y, first_moving.y);
      EXPECT_EQ(moving.heading, first_moving.heading);
      EXPECT_EQ(moving.bias, first_moving.bias);
      EXPECT_EQ(moving.bias_variance, first_moving.bias_variance);
    }
  }
}

}  // namespace
#endif

}  // namespace pf_resampling
