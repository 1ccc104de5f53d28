#pragma once

#include <string>

#include "pf_resampling_core/parameters/parameters.hpp"

namespace pf_resampling {

/// A parameter that is a name: any word but the empty one.
Parameter name_parameter(const std::string& name, std::string* field, const std::string& help);

/// A parameter that is any text.
Parameter text_parameter(const std::string& name, std::string* field, const std::string& help);

}  // namespace pf_resampling
