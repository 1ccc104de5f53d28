#pragma once

#include <vector>

namespace pf_resampling {

/// Within it are 95 % of squared Mahalanobis distances in the plane: chi-square, two degrees of
/// freedom.
constexpr double kChiSquare95TwoDof = 5.991464547107979;

/// Average of repeated runs, with how well it is known.
struct MeanEstimate {
  int count = 0;
  double mean = 0.0;            ///< 0 if count is 0
  double standard_error = 0.0;  ///< sample standard deviation / sqrt(count); 0 if count < 2
};
MeanEstimate mean_of(const std::vector<double>& values);

/// Mean of a[i] - b[i], of runs that share seed i: what both have in common cancels, so small
/// differences show. Throws Error if the sizes differ.
MeanEstimate paired_difference(const std::vector<double>& a, const std::vector<double>& b);

/// Median; of an even number of values the mean of the middle two. Throws Error on no values.
double median(std::vector<double> values);

/// Standard deviation of Gaussian noise about zero from the median absolute value, 1.4826 times it,
/// which up to half of the values cannot spoil. Throws Error on no values.
double robust_sigma(const std::vector<double>& residuals);

}  // namespace pf_resampling
