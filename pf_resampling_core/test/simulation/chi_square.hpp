#pragma once

#include <cmath>

namespace pf_resampling {

/// The value that a chi-square variable of `freedom` degrees exceeds with the probability that a
/// standard normal one exceeds `z` (Wilson and Hilferty 1931; better than 0.1 % from 100 degrees).
inline double chi_square_quantile(double freedom, double z) {
  const double a = 2.0 / (9.0 * freedom);
  return freedom * std::pow(1.0 - a + z * std::sqrt(a), 3.0);
}

/// A standard normal variable lies beyond this, on either side, once in a million.
inline constexpr double kOneInAMillion = 4.89;

/// Whether `sum` of squares of `count` numbers, each divided by its standard deviation, is one that
/// standard normal numbers give. False alarm once in a million.
inline bool is_chi_square(double sum, double count) {
  return sum > chi_square_quantile(count, -kOneInAMillion) &&
         sum < chi_square_quantile(count, kOneInAMillion);
}

}  // namespace pf_resampling
