#pragma once

#include <Eigen/Core>

namespace pf_resampling {

/// Probability that a position is further than `bound` (m, above 0) from the mean of a Gaussian
/// belief with this covariance (m^2). The standard deviations may be up to `doubt` (at least 1)
/// times as large as stated: every factor from 1 to there is as likely as another, on a logarithmic
/// scale. 1 for a covariance that is not finite.
double farther_probability(const Eigen::Matrix2d& covariance, double bound, double doubt = 1.0);

/// Probability that a belief with this deviation of the heading (rad) is worth nothing: half at 30
/// degrees, 1 - exp(-(sigma/36 degrees)^2).
double unknown_heading_probability(double heading_sigma);

/// That either is the case.
double either_probability(double first, double second);

}  // namespace pf_resampling
