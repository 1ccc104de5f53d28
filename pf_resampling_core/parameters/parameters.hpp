#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "pf_resampling_core/parameters/enum_names.hpp"

namespace pf_resampling {

/// One parameter of an options struct, bound to the field that holds it. The list of these is the
/// only home of a parameter's name, unit, range and help; its default is the field's initialiser.
/// YAML, the parameter server, dynamic_reconfigure and the documentation all go through it.
struct Parameter {
  enum class Type { boolean, integer, real, choice };

  std::string name;       ///< full name with its groups, "population/threshold"
  bool is_basic = false;  ///< one of those that a new robot or room may need set
  Type type = Type::real;
  std::string unit;      ///< SI: "m", "rad", "rad/s"; empty for a pure number
  std::string help;      ///< one sentence
  double minimum = 0.0;  ///< integer and real
  double maximum = 0.0;
  bool minimum_excluded = false;     ///< real: the range is open below
  std::vector<std::string> choices;  ///< choice

  std::function<std::string()> get;  ///< current value as text
  std::function<void(const std::string&)>
      set_checked;  ///< parses, checks the range, assigns; throws Error
};

using ParameterList = std::vector<Parameter>;

/// Builders, bound to `field`, which must outlive the parameter.
Parameter boolean_parameter(std::string name, bool* field, std::string help);
Parameter integer_parameter(std::string name, int* field, int minimum, int maximum,
                            std::string help);
Parameter real_parameter(std::string name, double* field, double minimum, double maximum,
                         std::string unit, std::string help);
/// Range open below: (minimum, maximum].
Parameter real_above_parameter(std::string name, double* field, double minimum, double maximum,
                               std::string unit, std::string help);
/// One of `values`, or of all that the enum has.
template <typename Enum>
Parameter choice_parameter(std::string name, Enum* field, const std::vector<Enum>& values,
                           std::string help);
template <typename Enum>
Parameter choice_parameter(std::string name, Enum* field, std::string help) {
  return choice_parameter(std::move(name), field, all_values<Enum>(), std::move(help));
}
/// A parameter as one of the basic ones.
Parameter basic(Parameter parameter);
/// The basic ones, then the others (for experts), each in their order.
ParameterList basic_first(ParameterList parameters);
/// Any text.
Parameter text_parameter(std::string name, std::string* field, std::string help);
/// A name: any text but the empty one.
Parameter name_parameter(std::string name, std::string* field, std::string help);

/// "bool", "int", "double", "string".
const char* type_text(Parameter::Type type);

/// Sets one parameter from text ("0.5", "true", "systematic"). Throws Error naming the parameter,
/// the value and the range; of an unknown name, what became of it, or the nearest known one.
void set_parameter(const ParameterList& parameters, const std::string& name,
                   const std::string& value);

/// Sets many; throws at the first that cannot be set.
void set_parameters(const ParameterList& parameters,
                    const std::map<std::string, std::string>& values);

/// Throws Error for the first value that is outside its range.
void check_values(const ParameterList& parameters);

/// All of them as YAML with unit, range and help as comments, each by its full name: all that there
/// is to set, as it is.
std::string to_yaml(const ParameterList& parameters);

/// The same with every value behind a #: a file that sets nothing until lines of it are taken in.
std::string to_template(const ParameterList& parameters);

/// All of them as a Markdown table: name, for whom, type, default, unit, range, meaning, and
/// whether a running node takes a change (`live`: those that it does).
std::string to_markdown(const ParameterList& parameters, const ParameterList& live);

// ---------------------------------------------------------------------------------------------------------------

Parameter make_choice_parameter(std::string name, std::vector<std::string> choices,
                                std::string help, std::function<std::string()> get,
                                std::function<void(const std::string&)> assign);

template <typename Enum>
Parameter choice_parameter(std::string name, Enum* field, const std::vector<Enum>& values,
                           std::string help) {
  std::vector<std::string> names;
  for (const Enum value : values) names.push_back(to_string(value));
  return make_choice_parameter(
      std::move(name), std::move(names), std::move(help), [field] { return to_string(*field); },
      [field, values](const std::string& text) {
        for (const Enum value : values) {
          if (to_string(value) == text) *field = value;
        }
      });
}

}  // namespace pf_resampling
