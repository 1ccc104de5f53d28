#pragma once

#include <cstdint>
#include <functional>

namespace pf_resampling {

/// Calls work(i) for every i in [0, count), `jobs` at a time, and after each, one at a time,
/// progress(number of those done). Rethrows the first exception; Error if the system does not start
/// as many threads.
void for_each_index(std::size_t count, int jobs, const std::function<void(std::size_t)>& work,
                    const std::function<void(std::uint64_t)>& progress);

}  // namespace pf_resampling
