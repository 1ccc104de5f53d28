#include "pf_resampling_core/evaluation/range_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/evaluation/statistics.hpp"
#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {
namespace {

using Samples = std::vector<RangeSample>;

struct Line {
  double scale = 1.0;
  double bias = 0.0;
  double scale_error = 0.0;  ///< per unit of sigma
  double bias_error = 0.0;   ///< likewise
};

void check(const Samples& samples, const RangeFitOptions& options) {
  if (!(options.outlier_threshold > 1.0)) {
    throw Error("outlier_threshold is " + std::to_string(options.outlier_threshold) +
                ": it is a number of standard deviations, > 1");
  }
  if (!(options.scale_tolerance > 0.0)) {
    throw Error("scale_tolerance is " + std::to_string(options.scale_tolerance) +
                ": it has to be > 0");
  }
  if (options.least_samples < 3) {
    throw Error("least_samples is " + std::to_string(options.least_samples) +
                ": scale, bias and sigma need at least 3");
  }
  if (samples.size() < static_cast<std::size_t>(options.least_samples)) {
    throw Error("calibration has " + std::to_string(samples.size()) +
                " ranges with a known distance: it needs at least " +
                std::to_string(options.least_samples));
  }
  for (const RangeSample& sample : samples) {
    if (!(std::isfinite(sample.range) && std::isfinite(sample.distance) &&
          sample.distance >= 0.0)) {
      throw Error("calibration: a range of " + std::to_string(sample.range) +
                  " m at a distance of " + std::to_string(sample.distance) + " m, beacon " +
                  std::to_string(sample.beacon) + ": both have to be finite, the distance >= 0");
    }
  }
}

std::vector<double> residuals(const Samples& samples, double scale, double bias) {
  std::vector<double> result;
  for (const RangeSample& sample : samples) {
    result.push_back(sample.range - scale * sample.distance - bias);
  }
  return result;
}

/// Siegel's repeated median: for each sample the median of its slopes to all others, of these the
/// median. Quadratic, so of at most a thousand samples, evenly taken.
double repeated_median_slope(const Samples& samples) {
  constexpr std::size_t kMostSamples = 1000;
  const std::size_t stride = (samples.size() + kMostSamples - 1) / kMostSamples;
  std::vector<double> medians;
  std::vector<double> slopes;
  for (std::size_t i = 0; i < samples.size(); i += stride) {
    slopes.clear();
    for (std::size_t j = 0; j < samples.size(); j += stride) {
      const double run = samples[j].distance - samples[i].distance;
      if (run != 0.0) slopes.push_back((samples[j].range - samples[i].range) / run);
    }
    if (!slopes.empty()) medians.push_back(median(slopes));
  }
  return medians.empty() ? 1.0 : median(medians);
}

/// Least squares of the samples that are `used`; the bias alone if the scale is fixed.
Line least_squares(const Samples& samples, const std::vector<bool>& used, bool scale_is_fixed) {
  double count = 0.0, distance = 0.0, range = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!used[i]) continue;
    count += 1.0;
    distance += samples[i].distance;
    range += samples[i].range;
  }
  distance /= count;
  range /= count;
  double spread = 0.0, product = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!used[i]) continue;
    spread += (samples[i].distance - distance) * (samples[i].distance - distance);
    product += (samples[i].distance - distance) * (samples[i].range - range);
  }
  Line line;
  if (scale_is_fixed) {
    line.bias_error = std::sqrt(1.0 / count);
  } else if (spread > 0.0) {
    line.scale = product / spread;
    line.scale_error = std::sqrt(1.0 / spread);
    line.bias_error = std::sqrt(1.0 / count + distance * distance / spread);
  } else {
    line.scale_error = std::numeric_limits<double>::infinity();
  }
  line.bias = range - line.scale * distance;
  return line;
}

/// Variance of a standard normal cut at +-threshold.
double cut_variance(double threshold) {
  const double density = std::exp(-0.5 * threshold * threshold) / std::sqrt(2.0 * kPi);
  return 1.0 - 2.0 * threshold * density / std::erf(threshold / std::sqrt(2.0));
}

/// The fit with the scale free or fixed at 1.
RangeFit robust_fit(const Samples& samples, const RangeFitOptions& options, bool scale_is_fixed) {
  constexpr int kMostRounds = 100;
  RangeFit fit;
  fit.samples = static_cast<int>(samples.size());
  fit.scale_is_fixed = scale_is_fixed;
  fit.calibration.scale = scale_is_fixed ? 1.0 : repeated_median_slope(samples);
  fit.calibration.bias = median(residuals(samples, fit.calibration.scale, 0.0));

  // The outliers are those of the last line; they settle within a few rounds, and where two sets
  // should take turns either is as good.
  std::vector<bool> used;
  Line line;
  for (int round = 0; round < kMostRounds; ++round) {
    const std::vector<double> errors =
        residuals(samples, fit.calibration.scale, fit.calibration.bias);
    // Ranges without noise: what is below a micrometre is no outlier.
    const double bound = options.outlier_threshold * std::max(robust_sigma(errors), 1e-6);
    std::vector<bool> inliers;
    inliers.reserve(errors.size());
    for (const double error : errors) inliers.push_back(std::abs(error) <= bound);
    if (inliers == used) break;
    used = inliers;
    line = least_squares(samples, used, scale_is_fixed);
    fit.calibration.scale = line.scale;
    fit.calibration.bias = line.bias;
  }

  const std::vector<double> errors =
      residuals(samples, fit.calibration.scale, fit.calibration.bias);
  double squares = 0.0;
  int inliers = 0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (!used[i]) continue;
    squares += errors[i] * errors[i];
    ++inliers;
  }
  fit.outliers = fit.samples - inliers;
  const double freedom = std::max(1.0, inliers - (scale_is_fixed ? 1.0 : 2.0));
  // Only where something was cut does the sum of squares lack its tails.
  const double share = fit.outliers > 0 ? cut_variance(options.outlier_threshold) : 1.0;
  fit.calibration.sigma = std::sqrt(squares / freedom / share);
  fit.scale_error = line.scale_error * fit.calibration.sigma;
  fit.bias_error = line.bias_error * fit.calibration.sigma;
  return fit;
}

}  // namespace

RangeFit fit_ranges(const Samples& samples, const RangeFitOptions& options) {
  check(samples, options);
  const auto nearer = [](const RangeSample& a, const RangeSample& b) {
    return a.distance < b.distance;
  };
  const auto [least, greatest] = std::minmax_element(samples.begin(), samples.end(), nearer);
  RangeFit fit = robust_fit(samples, options, false);
  // A NaN (0 times infinity: equal distances, no noise) determines nothing either.
  if (!(fit.scale_error <= options.scale_tolerance)) fit = robust_fit(samples, options, true);
  fit.least_distance = least->distance;
  fit.greatest_distance = greatest->distance;
  return fit;
}

std::vector<RangeFit> fit_ranges_per_beacon(const Samples& samples,
                                            const RangeFitOptions& options) {
  std::vector<RangeFit> fits = {fit_ranges(samples, options)};
  const RangeFit all = fits.front();
  std::map<int, Samples> by_beacon;
  for (const RangeSample& sample : samples) by_beacon[sample.beacon].push_back(sample);
  for (const auto& [beacon, own] : by_beacon) {
    RangeFit fit = all;
    if (own.size() >= static_cast<std::size_t>(options.least_samples)) {
      fit = fit_ranges(own, options);
    } else {
      fit.is_shared = true;
      fit.samples = static_cast<int>(own.size());
      fit.outliers = 0;
    }
    fit.beacon = beacon;
    fits.push_back(fit);
  }
  return fits;
}

}  // namespace pf_resampling
