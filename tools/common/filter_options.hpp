#pragma once

#include "src/configuration/configuration.hpp"
#include "tools/common/command_line.hpp"

namespace pf_resampling {

/// Adds the options by which a program lets a filter be configured: --config and --set.
inline void add_filter_options(CommandLine* line) {
  line->repeatable_option("config", "FILE",
                          "YAML file of parameters and lists (beacons, calibration, antennas, "
                          "sensors); may be repeated, later ones win");
  line->reads("config");
  line->repeatable_option(
      "set", "NAME=VALUE",
      "one parameter, for instance population/resampling/scheme=stratified; may be repeated");
}

/// What they say, applied on top of `options`. Throws Error naming file or assignment.
template <typename Options>
void apply_filter_options(const CommandLine& line, Options* options) {
  if (line.has("config")) {
    for (const std::string& path : line.get<std::vector<std::string>>("config")) {
      const Configuration configuration = read_configuration(path);
      try {
        apply(configuration, options);
      } catch (const Error& error) {
        throw Error(path + ": " + error.what());
      }
    }
  }
  if (line.has("set")) {
    for (const std::string& assignment : line.get<std::vector<std::string>>("set")) {
      apply(parse_assignment(assignment), options);
    }
  }
}

}  // namespace pf_resampling
