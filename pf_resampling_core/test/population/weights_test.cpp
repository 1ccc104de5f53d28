#include "pf_resampling_core/population/weights.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Eigen::ArrayXd random_log_weights(int size, double spread, double offset) {
  Eigen::ArrayXd values(size);
  RandomStream(3, RandomPurpose::test, static_cast<std::uint32_t>(size))
      .fill_normal(0, size, values.data());
  return values * spread + offset;
}

TEST(Normalize, IsLogSumExpInLongDouble) {
  for (const int size : {1, 2, 7, 8, 9, 255, 256, 257, 1000, 100003}) {
    for (const double spread : {0.0, 1.0, 30.0}) {
      for (const double offset : {0.0, -1e5, 1e5}) {
        const Eigen::ArrayXd before = random_log_weights(size, spread, offset);
        long double sum = 0.0L;
        long double weighted_logs = 0.0L;
        long double squares = 0.0L;
        const long double shift = before.maxCoeff();
        for (const double value : before) sum += std::exp(value - shift);
        for (const double value : before) {
          const long double weight = std::exp(value - shift) / sum;
          squares += weight * weight;
          if (weight > 0.0L) weighted_logs += weight * std::log(weight);
        }

        Eigen::ArrayXd log_weights = before;
        Eigen::ArrayXd linear(size);
        const WeightSummary summary = normalize(log_weights, linear);
        const double log_sum = static_cast<double>(shift + std::log(sum));
        EXPECT_NEAR(summary.log_sum, log_sum, 1e-12 + 1e-15 * std::abs(log_sum));
        EXPECT_NEAR(summary.effective_sample_size, static_cast<double>(1.0L / squares),
                    1e-11 * size);
        EXPECT_NEAR(summary.entropy_sample_size, static_cast<double>(std::exp(-weighted_logs)),
                    1e-11 * size);
        EXPECT_NEAR(linear.sum(), 1.0, 1e-12);
        for (int i = 0; i < size; ++i) {
          const double expected = static_cast<double>(std::exp(before[i] - shift) / sum);
          // The rounding of log-weights of 1e5 is 1e-11 of the weights.
          ASSERT_NEAR(linear[i], expected, 1e-12 * expected + 1e-300);
          ASSERT_NEAR(log_weights[i], before[i] - log_sum, 1e-10);
        }
      }
    }
  }
}

TEST(Normalize, EqualWeightsAreWorthTheirNumberAndOneIsWorthOne) {
  for (const int size : {1, 10, 1000000}) {
    Eigen::ArrayXd log_weights = Eigen::ArrayXd::Constant(size, -123.0);
    Eigen::ArrayXd linear(size);
    WeightSummary summary = normalize(log_weights, linear);
    EXPECT_NEAR(summary.effective_sample_size / size, 1.0, 1e-12);
    EXPECT_NEAR(summary.entropy_sample_size / size, 1.0, 1e-12);
    EXPECT_LE(summary.effective_sample_size, size);

    log_weights.setConstant(-kInfinite);
    log_weights[size / 2] = 5.0;
    summary = normalize(log_weights, linear);
    EXPECT_EQ(summary.effective_sample_size, 1.0);
    EXPECT_EQ(summary.entropy_sample_size, 1.0);
    EXPECT_EQ(linear[size / 2], 1.0);
    EXPECT_EQ(linear.sum(), 1.0);
    EXPECT_EQ(log_weights[size / 2], 0.0);
  }
}

TEST(Normalize, RefusesWhatIsNoDistributionAndChangesNothing) {
  for (const int size : {1, 8, 9, 300}) {
    const Eigen::ArrayXd good = random_log_weights(size, 1.0, 0.0);
    for (const double bad : {kNan, -kNan, kInfinite}) {
      for (const int place : {0, size / 2, size - 1}) {
        Eigen::ArrayXd log_weights = good;
        log_weights[place] = bad;
        Eigen::ArrayXd linear = Eigen::ArrayXd::Constant(size, 0.25);
        EXPECT_FALSE(is_normalizable(log_weights));
        EXPECT_THROW(normalize(log_weights, linear), Error);
        EXPECT_TRUE((linear == 0.25).all());
        for (int i = 0; i < size; ++i) {
          if (i == place) continue;
          ASSERT_EQ(log_weights[i], good[i]);
        }
      }
    }
    EXPECT_TRUE(is_normalizable(good));
    Eigen::ArrayXd none = Eigen::ArrayXd::Constant(size, -kInfinite);
    Eigen::ArrayXd linear(size);
    EXPECT_FALSE(is_normalizable(none));
    EXPECT_THROW(normalize(none, linear), Error);
  }
  Eigen::ArrayXd empty(0);
  Eigen::ArrayXd also_empty(0);
  EXPECT_FALSE(is_normalizable(empty));
  EXPECT_THROW(normalize(empty, also_empty), Error);
  Eigen::ArrayXd three = Eigen::ArrayXd::Zero(3);
  Eigen::ArrayXd four = Eigen::ArrayXd::Zero(4);
  EXPECT_THROW(normalize(three, four), Error);
}

// Weights 0.1, 0.2, 0.7 that likelihoods 3, 1, 0 come to, with a share of one half.
TEST(Temper, TakesUpAShareOfTheLikelihoods) {
  const double none = -kInfinite;
  const Eigen::ArrayXd before = Eigen::Array3d(0.1, 0.2, 0.7).log();
  Eigen::ArrayXd after = before + Eigen::Array3d(std::log(3.0), 0.0, none);
  const double left = temper(0.5, before, after);
  EXPECT_NEAR(after[0], std::log(0.1 * std::sqrt(3.0)), 1e-14);
  EXPECT_NEAR(after[1], std::log(0.2), 1e-14);
  EXPECT_EQ(after[2], none);
  EXPECT_NEAR(left, std::log(0.5 / (0.1 * std::sqrt(3.0) + 0.2)), 1e-14);

  Eigen::ArrayXd whole = before + 1.0;
  EXPECT_EQ(temper(1.0, before, whole), 0.0);
  EXPECT_TRUE((whole == before + 1.0).all());
}

TEST(Temper, AWeightOfZeroStaysOne) {
  const double none = -kInfinite;
  const Eigen::ArrayXd before = Eigen::Array2d(0.0, none);
  Eigen::ArrayXd after = Eigen::Array2d(-1.0, none);
  EXPECT_NEAR(temper(0.25, before, after), -0.75, 1e-14);
  EXPECT_NEAR(after[0], -0.25, 1e-14);
  EXPECT_EQ(after[1], none);
}

TEST(Temper, LeavesWhatIsNoDistribution) {
  const Eigen::ArrayXd before = Eigen::ArrayXd::Zero(2);
  Eigen::ArrayXd after = Eigen::ArrayXd::Constant(2, -kInfinite);
  EXPECT_EQ(temper(0.5, before, after), 0.0);
  EXPECT_TRUE((after == -kInfinite).all());
}

TEST(EffectiveSampleSize, IsOneOverTheSumOfSquares) {
  Eigen::ArrayXd weights(11);
  weights << 0.5, 0.1, 0.05, 0.05, 0.05, 0.05, 0.05, 0.05, 0.05, 0.025, 0.025;
  EXPECT_NEAR(effective_sample_size(weights), 1.0 / (0.25 + 0.01 + 7 * 0.0025 + 2 * 0.000625),
              1e-13);
}

}  // namespace
}  // namespace pf_resampling
