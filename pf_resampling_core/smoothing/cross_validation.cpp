#include "pf_resampling_core/smoothing/cross_validation.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace pf_resampling {
namespace {

// Squared errors of one and two degrees of freedom are cut off where 99.9 % lie below; the mean of
// the latter is then 2·(1 - exp(-13.8 / 2)).
constexpr double kLargestSquareOfOne = 10.8;
constexpr double kLargestSquareOfTwo = 13.8;
constexpr double kMeanSquareOfTwo = 1.998;
// Windows whose errors are for less than a quarter the odometry's say the less about it.
constexpr double kFullShare = 4.0;
// Without so many, odometry and sightings are not taken to be better than stated.
constexpr std::size_t kFewestWindows = 6;
constexpr std::size_t kFewestPassages = 20;
// Nor does one alone tell ranges from bearings.
constexpr std::size_t kFewestErrors = 3;
// Standard deviation of the logarithm of a scale before there is any block.
constexpr double kPriorSigma = 0.7;

Eigen::Matrix2d covariance_of(const PredictionError& e, const NoiseScales& scales) {
  return scales.range * scales.range * e.by_ranges +
         scales.bearing * scales.bearing * e.by_bearings +
         scales.motion * scales.motion * e.by_motions + e.by_prior;
}

// Means over prediction errors: their squares, in range, in bearing, and of both together; and the
// share of the odometry in their variances.
struct MeanSquares {
  double range = 0.0, bearing = 0.0, both = 0.0;
  double by_motions = 0.0;
};

MeanSquares mean_squares(const std::vector<PredictedBlock>& blocks, const NoiseScales& scales) {
  MeanSquares sum;
  double count = 0.0;
  for (const PredictedBlock& block : blocks) {
    for (const PredictionError& e : block) {
      const Eigen::Matrix2d covariance = covariance_of(e, scales);
      // What comes from a file may be anything.
      const double square_of_both = e.error.dot(covariance.inverse() * e.error);
      if (!covariance.allFinite() || covariance.diagonal().minCoeff() <= 0.0 ||
          covariance.determinant() <= 0.0 || !std::isfinite(square_of_both)) {
        continue;
      }
      const auto square = [&](int i) {
        return std::clamp(e.error[i] * e.error[i] / covariance(i, i), 0.0, kLargestSquareOfOne);
      };
      sum.range += square(0);
      sum.bearing += square(1);
      sum.both += std::clamp(square_of_both, 0.0, kLargestSquareOfTwo);
      const Eigen::Matrix2d by_motions = scales.motion * scales.motion * e.by_motions;
      sum.by_motions += by_motions.trace() / covariance.trace();
      ++count;
    }
  }
  if (count == 0.0) return {};
  return {sum.range / count, sum.bearing / count, sum.both / count, sum.by_motions / count};
}

// Relative standard error of the mean square of two errors; those of a block have much in common
// and are as good as one.
double standard_error(const std::vector<PredictedBlock>& blocks) {
  return 1.0 / std::sqrt(static_cast<double>(std::max<std::size_t>(1, blocks.size())));
}

// By how much a mean square exceeds a standard error more than it should be.
double excess(const MeanSquares& squares, const std::vector<PredictedBlock>& blocks) {
  return squares.both / kMeanSquareOfTwo / (1.0 + standard_error(blocks));
}

// Logarithm of how likely the errors are, up to a constant: those of a block count as one.
double log_likelihood(const std::vector<PredictedBlock>& blocks, const NoiseScales& scales) {
  double sum = 0.0;
  for (const PredictedBlock& block : blocks) {
    double of_block = 0.0;
    for (const PredictionError& e : block) {
      const Eigen::Matrix2d covariance = covariance_of(e, scales);
      const double square = e.error.dot(covariance.inverse() * e.error);
      const double determinant = covariance.determinant();
      if (!std::isfinite(square) || !(determinant > 0.0)) continue;
      of_block -= 0.5 * (std::log(determinant) + std::clamp(square, 0.0, kLargestSquareOfTwo));
    }
    sum += of_block / static_cast<double>(block.size());
  }
  return sum;
}

// The likeliest scale of the odometry, at most 1, under a log-normal prior, where sightings are as
// stated or better; larger by a standard error.
double better_motion(const std::vector<PredictedBlock>& windows, const NoiseScales& sightings) {
  constexpr int kSteps = 46;  // of 5 %, down to kSmallestNoiseScale
  double best = -std::numeric_limits<double>::infinity();
  double found = 1.0;
  for (int i = 0; i <= kSteps; ++i) {
    const double log_scale = std::log(kSmallestNoiseScale) * i / kSteps;
    const double of_prior = log_scale / kPriorSigma;
    const double scale = std::exp(log_scale);
    const double likelihood = log_likelihood(windows, {std::min(1.0, sightings.range),
                                                       std::min(1.0, sightings.bearing), scale}) -
                              0.5 * of_prior * of_prior;
    if (likelihood <= best) continue;
    best = likelihood;
    found = scale;
  }
  return std::min(1.0, found * std::sqrt(1.0 + standard_error(windows)));
}

// How much larger, in standard deviations, the errors of ranges are than those of bearings, nearer
// to 1 by a standard error. Of a few, one may be next to nothing.
double ratio_of_range(const std::vector<PredictedBlock>& passages, const NoiseScales& scales) {
  const MeanSquares squares = mean_squares(passages, scales);
  if (passages.size() < kFewestErrors || squares.range <= 0.0 || squares.bearing <= 0.0) return 1.0;
  const double ratio = 0.5 * std::log(squares.range / squares.bearing);
  const double error = standard_error(passages);
  return std::exp(ratio - std::clamp(ratio, -error, error));
}

double worse(double scale, double excess) {
  return std::clamp(scale * std::sqrt(excess), 1.0, kLargestNoiseScale);
}

}  // namespace

NoiseScales noise_scales(const std::vector<PredictedBlock>& passages,
                         const std::vector<PredictedBlock>& windows, const NoiseScales& scatter) {
  constexpr int kIterations = 30;
  const NoiseScales least = passages.size() < kFewestPassages ? NoiseScales{} : scatter;
  // Worse than stated: sightings are judged under odometry as stated. Both fitted together would
  // run along a ridge, on which errors that sightings have in common pass for noise of the
  // odometry.
  NoiseScales sightings = least, all;
  double of_sightings = 1.0;  // over the least
  for (int i = 0; i < kIterations; ++i) {
    of_sightings = worse(of_sightings, std::max(excess(mean_squares(passages, sightings), passages),
                                                excess(mean_squares(windows, sightings), windows)));
    sightings.range = of_sightings * least.range;
    sightings.bearing = of_sightings * least.bearing;
    const MeanSquares of_windows = mean_squares(windows, all);
    const double share = std::min(1.0, kFullShare * of_windows.by_motions);
    all.range = all.bearing = worse(all.range, excess(mean_squares(passages, all), passages));
    all.motion = worse(all.motion, std::pow(excess(of_windows, windows), share));
  }
  if (all.motion == 1.0 && windows.size() >= kFewestWindows) {
    all.motion = better_motion(windows, sightings);
  }
  // The product stays: what a sighting says of a place.
  const double root = std::sqrt(ratio_of_range(passages, sightings));
  return {std::clamp(sightings.range * root, least.range, kLargestNoiseScale),
          std::clamp(sightings.bearing / root, least.bearing, kLargestNoiseScale), all.motion};
}

double noise_doubt(std::size_t blocks) {
  constexpr double kMost = 6.0;
  return std::min(kMost, std::exp(1.5 / std::sqrt(static_cast<double>(blocks))));
}

}  // namespace pf_resampling
