#include "pf_resampling_core/health/lost_detector.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

// Bayes' rule by hand for one innovation after no time: prior odds 1e-6 : 1 - 1e-6.
TEST(LostDetector, OneInnovationIsBayesRule) {
  for (const double squared : {0.0, 1.0, 9.0, 100.0}) {
    LostDetector detector;
    detector.observe(squared, 1, 0.0);
    const double lost = 0.1 * std::exp(-0.005 * squared);
    const double right = 0.95 * std::exp(-0.5 * squared) + 0.05 * lost;
    const double posterior = 1e-6 * lost / (1e-6 * lost + (1.0 - 1e-6) * right);
    EXPECT_NEAR(detector.probability(), std::max(posterior, 1e-6), 1e-12) << squared;
  }
}

// Over about the last 40: what is older has a weight of about e^-2 then, which is 0.135.
TEST(LostDetector, TheMeanInnovationIsOfAboutTheLastForty) {
  LostDetector detector;
  for (int i = 0; i < 40; ++i) detector.observe(2.0 * 5.0, 2, 0.2);
  EXPECT_NEAR(detector.normalized_innovation(), 5.0 - 4.0 * std::exp(-2.0), 0.1);
}

// With innovations that are as likely of a right filter as of a lost one, the share of time lost is
// that of the transition rates: 60 / (3600 + 60).
TEST(LostDetector, WithoutInformationItIsTheShareOfTimeLost) {
  const double squared = 2.0 * std::log(10.0) / (1.0 - 0.01);
  LostDetector detector;
  for (int second = 0; second < 5000; ++second) detector.observe(squared, 1, 1.0);
  EXPECT_NEAR(detector.probability(), 60.0 / 3660.0, 1e-3);
}

// A right filter's innovations, 5 % of them wild, 4 a second for an hour: the probability is above
// one half at most in short bursts. That three of five neighbouring innovations are wild has a
// chance of 1e-3 a window, so a few of 14,400 steps may exceed; 1 % would be 144.
TEST(LostDetector, OutliersOfARightFilterAreForgiven) {
  const RandomStream random(1, RandomPurpose::test, 0);
  LostDetector detector;
  int alarms = 0;
  for (std::uint64_t k = 0; k < 14400; ++k) {
    const bool wild = random.uniform(2 * k) < 0.05;
    const double innovation = random.normal(2 * k + 1) * (wild ? 10.0 : 1.0);
    detector.observe(innovation * innovation, 1, 0.25);
    alarms += detector.probability() > 0.5 ? 1 : 0;
  }
  EXPECT_LT(alarms, 144);
}

// Innovations as wide as those of a lost filter: known within ten seconds, and forgotten within
// ten when they fit again.
TEST(LostDetector, IsQuickBothWays) {
  const RandomStream random(1, RandomPurpose::test, 1);
  LostDetector detector;
  std::uint64_t k = 0;
  const auto run = [&](double spread, int count) {
    for (int i = 0; i < count; ++i, ++k) {
      const double innovation = spread * random.normal(k);
      detector.observe(innovation * innovation, 1, 0.25);
    }
  };
  run(1.0, 400);
  EXPECT_LT(detector.probability(), 0.05);
  EXPECT_NEAR(detector.normalized_innovation(), 1.0, 1.0);
  run(10.0, 40);
  EXPECT_GT(detector.probability(), 0.9);
  EXPECT_GT(detector.normalized_innovation(), 10.0);
  run(1.0, 40);
  EXPECT_LT(detector.probability(), 0.1);
}

TEST(LostDetector, WhatIsNotFiniteIsPassedOverAndTheFarthestCounts) {
  LostDetector detector;
  const double before = detector.probability();
  detector.observe(std::nan(""), 1, 1.0);
  detector.observe(-1.0, 1, 1.0);
  detector.observe(1.0, 0, 1.0);
  EXPECT_EQ(detector.probability(), before);
  for (int k = 0; k < 10; ++k) detector.observe(1e9, 1, std::nan(""));
  EXPECT_GT(detector.probability(), 0.9);
  detector.reset();
  EXPECT_EQ(detector.probability(), before);
}

}  // namespace
}  // namespace pf_resampling
