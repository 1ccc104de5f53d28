#pragma once

#include <vector>

namespace pf_resampling {

/// Within it are 95 % of squared Mahalanobis distances in the plane: chi-square, two degrees of
/// freedom.
constexpr double kChiSquare95TwoDof = 5.991464547107979;

/// Median; of an even number of values the mean of the middle two. Throws Error on no values.
double median(std::vector<double> values);

}  // namespace pf_resampling
