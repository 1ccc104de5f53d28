#pragma once

#include <string>

namespace pf_resampling {

/// How long one resampling takes, as a table `scheme,particles,microseconds`: for every scheme and
/// 100 to 100,000 particles, the median of many, on weights that are exponentials of random numbers
/// (Mahmoud 2012, Fig. 8). By the clock, so different every time.
std::string scheme_times();

}  // namespace pf_resampling
