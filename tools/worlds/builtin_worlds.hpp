#pragma once

#include <map>
#include <string>

namespace pf_resampling {

/// Name and text of each file of config/worlds, compiled in so that a program needs no path to
/// them.
const std::map<std::string, std::string>& builtin_world_texts();

}  // namespace pf_resampling
