#include "pf_resampling_core/evaluation/statistics.hpp"

#include <algorithm>
#include <cmath>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {

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
