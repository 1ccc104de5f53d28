#include "pf_resampling_core/health/unknown_place.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {
namespace {

// Steps of the integrals, over directions and over factors.
constexpr int kDirections = 32;
constexpr int kFactors = 16;
// Share of a full turn.
constexpr double kUnknownShare = 0.1;

}  // namespace

// A Gaussian error is a Rayleigh distance in a direction that is uniform, stretched by the axes of
// the covariance. Given the direction, the distance is beyond the bound with exp(-bound^2/(2 v)),
// v the variance that the axes give it.
double farther_probability(const Eigen::Matrix2d& covariance, double bound, double doubt) {
  if (!covariance.allFinite()) return 1.0;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(covariance, Eigen::EigenvaluesOnly);
  const Eigen::Vector2d variances = axes.eigenvalues().cwiseMax(0.0);
  const int factors = doubt > 1.0 ? kFactors : 1;
  double sum = 0.0;
  for (int f = 0; f < factors; ++f) {
    const double factor = doubt > 1.0 ? std::pow(doubt, (f + 0.5) / factors) : 1.0;
    for (int d = 0; d < kDirections; ++d) {
      const double cosine = std::cos((d + 0.5) * kPi / kDirections);
      const double variance =
          variances[0] + cosine * cosine * (variances[1] - variances[0]);  // in this direction
      if (variance > 0.0) sum += std::exp(-0.5 * bound * bound / (factor * factor * variance));
    }
  }
  return sum / (factors * kDirections);
}

double unknown_heading_probability(double heading_sigma) {
  const double ratio = heading_sigma / (kUnknownShare * 2.0 * kPi);
  return 1.0 - std::exp(-ratio * ratio);
}

double either_probability(double first, double second) {
  return first + second - first * second;
}

}  // namespace pf_resampling
