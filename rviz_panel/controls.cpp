#include "rviz_panel/controls.hpp"

#include <dynamic_reconfigure/config_tools.h>
#include <yaml-cpp/yaml.h>

#include <cstdio>
#include <cstdlib>

#include "src/node/reconfigure_server.hpp"

namespace pf_resampling {
namespace {

// The choices are written as a Python expression of dictionaries, lists, texts and numbers, which
// YAML can read. What cannot be read is set as a text.
std::vector<std::string> choices_of(const dynamic_reconfigure::ParamDescription& parameter) {
  if (parameter.type == "bool") return {"false", "true"};
  std::vector<std::string> choices;
  try {
    const YAML::Node description = YAML::Load(parameter.edit_method);
    if (!description.IsMap()) return {};
    for (const YAML::Node& choice : description["enum"]) {
      choices.push_back(choice["value"].as<std::string>());
    }
  } catch (const YAML::Exception&) {
    choices.clear();
  }
  return choices;
}

std::string short_number(const std::string& number) {
  char text[40];
  std::snprintf(text, sizeof(text), "%g", std::strtod(number.c_str(), nullptr));
  return text;
}

}  // namespace

std::vector<Control> basic_controls(const dynamic_reconfigure::ConfigDescription& description) {
  auto minima = values_of(description.min);
  auto maxima = values_of(description.max);
  std::vector<Control> controls;
  for (const auto& group : description.groups) {
    for (const auto& parameter : group.parameters) {
      if (parameter.level != kBasicLevel) continue;
      Control control = {parameter.name, choices_of(parameter),
                         parameter.name + "\n" + parameter.description};
      if (control.choices.empty() && !minima[control.name].empty()) {
        control.help += "\nfrom " + short_number(minima[control.name]) + " to " +
                        short_number(maxima[control.name]);
      }
      controls.push_back(control);
    }
  }
  return controls;
}

dynamic_reconfigure::Config request_of(const std::string& name, const std::string& value) {
  dynamic_reconfigure::Config config;
  dynamic_reconfigure::ConfigTools::appendParameter(config, name, value);
  return config;
}

}  // namespace pf_resampling
