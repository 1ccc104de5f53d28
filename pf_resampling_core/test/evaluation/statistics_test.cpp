#include "pf_resampling_core/evaluation/statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

TEST(MeanOf, GivesMeanAndStandardError) {
  // Sample variance of 2, 4, 9 is (9 + 1 + 16) / 2 = 13.
  const MeanEstimate estimate = mean_of({2.0, 4.0, 9.0});
  EXPECT_EQ(estimate.count, 3);
  EXPECT_DOUBLE_EQ(estimate.mean, 5.0);
  EXPECT_DOUBLE_EQ(estimate.standard_error, std::sqrt(13.0 / 3.0));
  EXPECT_DOUBLE_EQ(mean_of({4.0}).mean, 4.0);
  EXPECT_DOUBLE_EQ(mean_of({4.0}).standard_error, 0.0);
  EXPECT_EQ(mean_of({}).count, 0);
}

TEST(PairedDifference, CancelsWhatPairsShare) {
  const MeanEstimate estimate = paired_difference({10.0, 200.0, 3000.0}, {9.0, 199.0, 2999.0});
  EXPECT_DOUBLE_EQ(estimate.mean, 1.0);
  EXPECT_DOUBLE_EQ(estimate.standard_error, 0.0);
  EXPECT_THROW(paired_difference({1.0}, {}), Error);
}

TEST(Median, OfOddAndEvenNumbers) {
  EXPECT_DOUBLE_EQ(median({5.0, 1.0, 3.0}), 3.0);
  EXPECT_DOUBLE_EQ(median({5.0, 1.0, 4.0, 2.0}), 3.0);
  EXPECT_THROW(median({}), Error);
}

TEST(RobustSigma, IsTheStandardDeviationOfGaussianNoise) {
  std::vector<double> noise(40000);
  const RandomStream stream(1, RandomPurpose::test, 0);
  for (std::size_t i = 0; i < noise.size(); ++i) noise[i] = 3.0 * stream.normal(i);
  // Standard error of the estimate: 1.17 sigma / sqrt(n); five of them, 6e-7.
  EXPECT_NEAR(robust_sigma(noise), 3.0, 5.0 * 1.17 * 3.0 / 200.0);
}

}  // namespace
}  // namespace pf_resampling
