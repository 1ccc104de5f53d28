#pragma once

#include "pf_resampling_core/parameters/parameters.hpp"
#include "tools/common/command_line.hpp"

namespace pf_resampling {

/// Sets the parameters that have options of their own: --seed and --threads.
void apply_run_parameters(const CommandLine& line, const ParameterList& parameters);

/// Prints them as --parameters asks: yaml or markdown.
void print_parameters(const CommandLine& line, const ParameterList& parameters);

}  // namespace pf_resampling
