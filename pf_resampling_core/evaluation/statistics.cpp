#include "pf_resampling_core/evaluation/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {

MeanEstimate mean_of(const std::vector<double>& values) {
  MeanEstimate result;
  result.count = static_cast<int>(values.size());
  if (values.empty()) return result;
  const double count = static_cast<double>(values.size());
  for (const double value : values) result.mean += value / count;
  if (values.size() < 2) return result;
  double squares = 0.0;
  for (const double value : values) squares += (value - result.mean) * (value - result.mean);
  result.standard_error = std::sqrt(squares / (count - 1.0) / count);
  return result;
}

MeanEstimate paired_difference(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() != b.size()) {
    throw Error("paired difference of " + std::to_string(a.size()) + " and " +
                std::to_string(b.size()) + " values: pairs need as many of one as of the other");
  }
  std::vector<double> differences;
  for (std::size_t i = 0; i < a.size(); ++i) differences.push_back(a[i] - b[i]);
  return mean_of(differences);
}

double median(std::vector<double> values) {
  if (values.empty()) throw Error("median of no values: it needs at least one");
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

double robust_sigma(const std::vector<double>& residuals) {
  constexpr double kSigmaOverMedian = 1.4826022185056018;  // 1 / the normal quantile of 3/4
  std::vector<double> sizes;
  sizes.reserve(residuals.size());
  for (const double residual : residuals) sizes.push_back(std::abs(residual));
  return kSigmaOverMedian * median(std::move(sizes));
}

}  // namespace pf_resampling
