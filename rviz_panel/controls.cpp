#include "rviz_panel/controls.hpp"

#include <dynamic_reconfigure/config_tools.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <map>

#include "pf_resampling_core/error.hpp"
#include "src/node/reconfigure_server.hpp"

namespace pf_resampling {
namespace {

// "population/resampling" without its parent "population" -> "resampling"; to be read.
std::string label_of(const std::string& name, const std::string& group) {
  std::string label = name;
  if (!group.empty() && name.rfind(group + "/", 0) == 0) label = name.substr(group.size() + 1);
  std::replace(label.begin(), label.end(), '_', ' ');
  return label;
}

// The choices are written as a Python expression of dictionaries, lists, texts and numbers, which
// YAML can read. What cannot be read is set as a text.
std::vector<Control::Choice> choices_of(const std::string& edit_method) {
  std::vector<Control::Choice> choices;
  if (edit_method.empty()) return choices;
  try {
    for (const YAML::Node& entry : YAML::Load(edit_method)["enum"]) {
      Control::Choice choice;
      choice.name = entry["name"].as<std::string>();
      choice.value = entry["value"].as<std::string>();
      if (entry["description"]) choice.help = entry["description"].as<std::string>();
      choices.push_back(choice);
    }
  } catch (const YAML::Exception&) {
    choices.clear();
  }
  return choices;
}

Control::Kind kind_of(const std::string& type) {
  if (type == "bool") return Control::Kind::boolean;
  if (type == "int") return Control::Kind::integer;
  if (type == "double") return Control::Kind::real;
  return Control::Kind::text;
}

// Limits that were not given are those of the type.
double limit_of(const std::map<std::string, std::string>& limits, const Control& control,
                double unlimited) {
  const auto found = limits.find(control.name);
  const double limit =
      found == limits.end() ? unlimited : std::strtod(found->second.c_str(), nullptr);
  if (control.kind != Control::Kind::integer) return limit;
  return std::min(std::max(limit, -2147483648.0), 2147483647.0);
}

std::string short_number(double value) {
  char text[40];
  std::snprintf(text, sizeof(text), "%g", value);
  return text;
}

[[noreturn]] void refuse(const Control& control, const std::string& value, const char* type) {
  throw Error(control.name + ": '" + value + "' is not " + type);
}

}  // namespace

std::vector<ControlGroup> controls_of(const dynamic_reconfigure::ConfigDescription& description) {
  const auto minima = values_of(description.min);
  const auto maxima = values_of(description.max);
  const auto defaults = values_of(description.dflt);
  constexpr double kUnlimited = std::numeric_limits<double>::max();

  std::vector<ControlGroup> groups;
  std::map<int, int> index_of_id;
  for (const auto& described : description.groups) {
    ControlGroup group;
    // The group of everything names nothing.
    group.name = groups.empty() && described.id == 0 ? "" : described.name;
    const auto parent = index_of_id.find(described.parent);
    if (parent != index_of_id.end() && described.parent != described.id && parent->second != 0) {
      group.parent = parent->second;
    }
    group.label = label_of(
        group.name, group.parent < 0 ? "" : groups[static_cast<std::size_t>(group.parent)].name);
    for (const auto& parameter : described.parameters) {
      Control control;
      control.name = parameter.name;
      control.label = label_of(parameter.name, group.name);
      control.type = parameter.type;
      control.kind = kind_of(parameter.type);
      control.choices = choices_of(parameter.edit_method);
      if (!control.choices.empty()) control.kind = Control::Kind::choice;
      control.minimum = limit_of(minima, control, -kUnlimited);
      control.maximum = limit_of(maxima, control, kUnlimited);
      control.help = parameter.description;
      const auto initial = defaults.find(parameter.name);
      if (initial != defaults.end()) control.initial = initial->second;
      group.controls.push_back(control);
    }
    index_of_id[described.id] = static_cast<int>(groups.size());
    groups.push_back(group);
  }
  return groups;
}

dynamic_reconfigure::Config request_of(const Control& control, const std::string& value) {
  using dynamic_reconfigure::ConfigTools;
  dynamic_reconfigure::Config config;
  char* end = nullptr;
  if (control.type == "bool") {
    if (value != "true" && value != "false") refuse(control, value, "true or false");
    ConfigTools::appendParameter(config, control.name, value == "true");
  } else if (control.type == "int") {
    const long number = std::strtol(value.c_str(), &end, 10);
    if (value.empty() || *end != '\0' || std::labs(number) > std::numeric_limits<int>::max()) {
      refuse(control, value, "an integer");
    }
    ConfigTools::appendParameter(config, control.name, static_cast<int>(number));
  } else if (control.type == "double") {
    const double number = std::strtod(value.c_str(), &end);
    if (value.empty() || *end != '\0' || !std::isfinite(number)) refuse(control, value, "a number");
    ConfigTools::appendParameter(config, control.name, number);
  } else {
    ConfigTools::appendParameter(config, control.name, value);
  }
  return config;
}

std::string tooltip_of(const Control& control) {
  std::string text = control.name;
  if (!control.help.empty()) text += "\n" + control.help;
  const bool is_number =
      control.kind == Control::Kind::integer || control.kind == Control::Kind::real;
  if (is_number && control.minimum > -1e300 && control.maximum < 1e300) {
    text += "\nfrom " + short_number(control.minimum) + " to " + short_number(control.maximum);
  }
  for (const Control::Choice& choice : control.choices) {
    if (!choice.help.empty()) text += "\n" + choice.name + ": " + choice.help;
  }
  if (!control.initial.empty()) {
    text += "\nat the start: " + (control.kind == Control::Kind::real
                                      ? short_number(std::strtod(control.initial.c_str(), nullptr))
                                      : control.initial);
  }
  return text;
}

}  // namespace pf_resampling
