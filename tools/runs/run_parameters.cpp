#include "tools/runs/run_parameters.hpp"

#include <iostream>

namespace pf_resampling {

void apply_run_parameters(const CommandLine& line, const ParameterList& parameters) {
  if (line.has("seed")) set_parameter(parameters, "seed", line.text("seed"));
  if (line.has("threads")) set_parameter(parameters, "threads", line.text("threads"));
}

void print_parameters(const CommandLine& line, const ParameterList& parameters) {
  const auto format = line.text("parameters");
  if (format != "yaml" && format != "markdown") {
    throw UsageError("--parameters is '" + format + "', has to be yaml or markdown");
  }
  std::cout << (format == "yaml" ? to_yaml(parameters) : to_markdown(parameters));
}

}  // namespace pf_resampling
