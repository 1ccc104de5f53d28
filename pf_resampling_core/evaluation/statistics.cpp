#include "pf_resampling_core/evaluation/statistics.hpp"

#include <algorithm>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {

double median(std::vector<double> values) {
  if (values.empty()) throw Error("median of no values: it needs at least one");
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

}  // namespace pf_resampling
