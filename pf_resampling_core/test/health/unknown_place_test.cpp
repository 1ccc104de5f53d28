#include "pf_resampling_core/health/unknown_place.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace pf_resampling {
namespace {

Eigen::Matrix2d covariance(double xx, double xy, double yy) {
  Eigen::Matrix2d matrix;
  matrix << xx, xy, xy, yy;
  return matrix;
}

// The distance of a round Gaussian has Rayleigh's distribution; a narrow one is half-normal.
TEST(UnknownPlace, RoundAndNarrowBeliefsHaveClosedForms) {
  for (const double bound : {0.1, 1.0, 3.0}) {
    EXPECT_NEAR(farther_probability(covariance(4.0, 0.0, 4.0), bound),
                std::exp(-bound * bound / 8.0), 1e-12);
    // Along a diagonal, of variance 4.
    EXPECT_NEAR(farther_probability(covariance(2.0, 2.0, 2.0), bound),
                std::erfc(bound / 2.0 / std::sqrt(2.0)), 0.02)
        << bound;
  }
}

// Over a factor s that is log-uniform from 1 to d, with a = bound^2/(2 sigma^2), the mean of
// exp(-a/s^2) is (E1(a/d^2) - E1(a)) / (2 ln d); E1(x) = -Ei(-x).
TEST(UnknownPlace, DoubtIsAMeanOverFactors) {
  const auto e1 = [](double x) { return -std::expint(-x); };
  for (const double bound : {0.5, 2.0, 6.0}) {
    for (const double doubt : {1.2, 3.0, 6.0}) {
      const double a = bound * bound / 2.0;
      const double expected = (e1(a / (doubt * doubt)) - e1(a)) / (2.0 * std::log(doubt));
      EXPECT_NEAR(farther_probability(covariance(1.0, 0.0, 1.0), bound, doubt), expected, 2e-3)
          << bound << " " << doubt;
    }
  }
}

TEST(UnknownPlace, CertaintyAndNothingKnown) {
  EXPECT_EQ(farther_probability(Eigen::Matrix2d::Zero(), 0.2), 0.0);
  EXPECT_NEAR(farther_probability(covariance(1e12, 0.0, 1e12), 1.0), 1.0, 1e-9);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(farther_probability(covariance(nan, 0.0, 1.0), 1.0), 1.0);
  // Rounding may leave a variance just below zero.
  EXPECT_EQ(farther_probability(covariance(-1e-18, 0.0, 0.0), 1.0), 0.0);
}

TEST(UnknownPlace, EitherOfTwo) {
  EXPECT_NEAR(either_probability(0.5, 0.5), 0.75, 1e-12);
  EXPECT_EQ(either_probability(0.0, 1.0), 1.0);
}

}  // namespace
}  // namespace pf_resampling
