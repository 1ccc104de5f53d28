#include "pf_resampling_core/evaluation/statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

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
