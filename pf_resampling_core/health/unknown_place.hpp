#pragma once

#include <Eigen/Core>

namespace pf_resampling {

/// m. A robot is lost when it is further off than radio noise explains (0.2 m) plus 3 % of the
/// extent of its scene, the diagonal of the area (m): 3.1 m on Plaza 2 (96 m), 0.29 m in the
/// labyrinth (3 m). A wrong mode of a range-only belief is off by a good part of the area, so the
/// verdict hardly depends on the figure.
double lost_error(double extent);

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
