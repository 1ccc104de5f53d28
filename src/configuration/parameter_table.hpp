#pragma once

#include <string>

#include "pf_resampling_core/parameters/parameters.hpp"

namespace pf_resampling {

/// to_markdown() of all parameters of a node with one column more: whether a running node takes a
/// change (`live`: those that it does).
std::string parameter_table(const ParameterList& parameters, const ParameterList& live);

}  // namespace pf_resampling
