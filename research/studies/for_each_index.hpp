#pragma once

#include <cstddef>
#include <functional>

namespace pf_resampling {

/// Calls work(i) for every i in [0, count), `jobs` at a time; rethrows the first exception.
void for_each_index(std::size_t count, int jobs, const std::function<void(std::size_t)>& work);

}  // namespace pf_resampling
