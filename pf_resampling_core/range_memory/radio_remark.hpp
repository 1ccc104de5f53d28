#pragma once

#include <string>
#include <vector>

#include "pf_resampling_core/models/beacon_range.hpp"
#include "pf_resampling_core/range_memory/range_memory.hpp"

namespace pf_resampling {

/// What is wrong with a radio, and what to do, in one line; empty if it is as listed or not listed.
std::string remark_on(const RadioKnowledge& radio, const std::vector<Beacon>& listed);

/// What is known of a radio's place, and how to know more, in one line.
std::string place_in_words(const RadioKnowledge& radio);

}  // namespace pf_resampling
