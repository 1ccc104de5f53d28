#pragma once

#include <vector>

namespace pf_resampling {

/// Within it are 95 % of squared Mahalanobis distances in the plane: chi-square, two degrees of
/// freedom.
constexpr double kChiSquare95TwoDof = 5.991464547107979;

/// Median; of an even number of values the mean of the middle two. Throws Error on no values.
double median(std::vector<double> values);

/// Standard deviation of Gaussian noise about zero from the median absolute value, 1.4826 times it,
/// which up to half of the values cannot spoil. Throws Error on no values.
double robust_sigma(const std::vector<double>& residuals);

}  // namespace pf_resampling
