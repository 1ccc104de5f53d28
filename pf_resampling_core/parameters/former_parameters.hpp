#pragma once

#include <map>
#include <string>

namespace pf_resampling {

/// Parameters that there were once, each with the value that it is fixed at now, for whoever has
/// one in an old configuration.
const std::map<std::string, std::string>& former_parameters();

}  // namespace pf_resampling
