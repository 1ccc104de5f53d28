#include "src/configuration/parameter_table.hpp"

#include <set>
#include <sstream>

namespace pf_resampling {

std::string parameter_table(const ParameterList& parameters, const ParameterList& live) {
  std::set<std::string> names;
  for (const Parameter& parameter : live) names.insert(parameter.name);
  std::istringstream lines(to_markdown(parameters));
  std::string table, line;
  // Two lines of head, then one for each parameter.
  if (std::getline(lines, line)) table += line + " changes |\n";
  if (std::getline(lines, line)) table += line + "---|\n";
  for (const Parameter& parameter : parameters) {
    if (!std::getline(lines, line)) break;
    table += line + (names.count(parameter.name) > 0 ? " live |\n" : " at start |\n");
  }
  return table;
}

}  // namespace pf_resampling
