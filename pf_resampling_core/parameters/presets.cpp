#include "pf_resampling_core/parameters/presets.hpp"

#include <algorithm>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

const Parameter* find(const ParameterList& parameters, const std::string& name) {
  const auto found =
      std::find_if(parameters.begin(), parameters.end(),
                   [&](const Parameter& parameter) { return parameter.name == name; });
  return found == parameters.end() ? nullptr : &*found;
}

std::vector<std::string> names_of(const PresetList& presets) {
  std::vector<std::string> names;
  for (const Preset& preset : presets) names.push_back(preset.name);
  return names;
}

}  // namespace

const Preset& preset_named(const PresetList& presets, const std::string& name) {
  std::string known;
  for (const Preset& preset : presets) {
    if (preset.name == name) return preset;
    known += (known.empty() ? "" : ", ") + preset.name;
  }
  throw Error("unknown preset '" + name + "'; known are " + known);
}

Parameter preset_parameter(const PresetList& presets, std::string* field) {
  std::string help = "Set of values in place of the defaults; what you set yourself wins.";
  for (const Preset& preset : presets) {
    help += (&preset == &presets.front() ? " " : "; ") + preset.name + ": " + preset.meaning;
  }
  return basic(make_choice_parameter(
      "preset", names_of(presets), help + ".", [field] { return *field; },
      [field](const std::string& name) { *field = name; }));
}

std::map<std::string, std::string> values_under(const Preset& preset, const PresetList& presets,
                                                const ParameterList& defaults) {
  std::map<std::string, std::string> values;
  for (const Preset& other : presets) {
    for (const auto& [name, value] : other.values) {
      const Parameter* parameter = find(defaults, name);
      if (parameter == nullptr) {
        throw Error("preset " + other.name + " sets " + name + ", which is no parameter");
      }
      values[name] = parameter->get();
    }
  }
  for (const auto& [name, value] : preset.values) values[name] = value;
  return values;
}

void apply_preset(const Preset& preset, const PresetList& presets, const ParameterList& defaults,
                  const std::set<std::string>& given, const ParameterList& parameters) {
  for (const auto& [name, value] : values_under(preset, presets, defaults)) {
    if (given.count(name) == 0) set_parameter(parameters, name, value);
  }
}

std::string departures_from(const Preset& preset, const ParameterList& parameters) {
  std::string departures;
  for (const auto& [name, value] : preset.values) {
    const Parameter* parameter = find(parameters, name);
    if (parameter == nullptr) continue;
    // 0.10 is 0.1: a value is compared as the parameter itself writes it.
    const std::string present = parameter->get();
    parameter->set_checked(value);
    const std::string wanted = parameter->get();
    parameter->set_checked(present);
    if (present == wanted) continue;
    departures += (departures.empty() ? "" : ", ") + name + " is " + present + " (" + wanted +
                  " in " + preset.name + ")";
  }
  return departures;
}

}  // namespace pf_resampling
