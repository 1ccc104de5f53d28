#pragma once

#include <string>
#include <vector>

namespace pf_resampling {

/// `value` with `decimals` digits after the point.
std::string fixed(double value, int decimals);

/// The words one after the other, the separator between.
std::string joined(const std::vector<std::string>& words, const std::string& separator);

}  // namespace pf_resampling
