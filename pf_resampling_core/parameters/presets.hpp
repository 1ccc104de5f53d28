#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "pf_resampling_core/parameters/parameters.hpp"

namespace pf_resampling {

/// A set of values that stand in place of the defaults, under one name.
struct Preset {
  std::string name;
  std::string meaning;                        ///< a few words, for the help of the parameter
  std::map<std::string, std::string> values;  ///< parameter -> value; all others: the default
};
using PresetList = std::vector<Preset>;

/// The one of this name. Throws Error that lists the names there are.
const Preset& preset_named(const PresetList& presets, const std::string& name);

/// The parameter `preset`: a choice of their names, which says what each of them means. Setting it
/// sets the name alone; apply_preset() does the rest.
Parameter preset_parameter(const PresetList& presets, std::string* field);

/// What apply_preset() sets: every parameter that one of the presets sets has the value that
/// `preset` gives it, or else that of `defaults`.
std::map<std::string, std::string> values_under(const Preset& preset, const PresetList& presets,
                                                const ParameterList& defaults);

/// Sets these values, but not those of the parameters in `given`, which the user has set himself.
/// Parameters that no preset sets stay as they are.
void apply_preset(const Preset& preset, const PresetList& presets, const ParameterList& defaults,
                  const std::set<std::string>& given, const ParameterList& parameters);

/// What of a preset does not hold, since it was set otherwise: "particles is 300 (100 in balanced)"
/// and so on, separated by commas; empty if all of it does.
std::string departures_from(const Preset& preset, const ParameterList& parameters);

}  // namespace pf_resampling
