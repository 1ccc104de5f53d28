#pragma once

#include <string>
#include <vector>

#include "pf_resampling_core/simulation/world.hpp"

namespace pf_resampling {

/// Names of the worlds that come with the package (config/worlds), in alphabetical order.
std::vector<std::string> builtin_worlds();

/// A world from YAML text; the files of config/worlds explain each value. `source` names the text
/// in errors. Throws Error naming source, line and key of the first thing that is unknown, missing
/// or makes no sense.
World parse_world(const std::string& text, const std::string& source);

/// A world that comes with the package, by name, or from a YAML file, by path. Throws Error; for an
/// unknown name the line lists those known.
World load_world(const std::string& name_or_path);

}  // namespace pf_resampling
