#include "pf_resampling_core/parameters/parameters.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <sstream>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/parameters/former_parameters.hpp"

namespace pf_resampling {
namespace {

// The shortest decimal text that reads back as the same number, with an exponent only where the
// number is very large or small, and then with a point before it: to readers of YAML 1.1
// (roslaunch, rosparam) 1e-05 is a word.
std::string shortest_text(double value) {
  for (int digits = 15; digits <= 17; ++digits) {
    std::ostringstream stream;
    stream.precision(digits);
    stream << value;
    std::string text = stream.str();
    if (std::strtod(text.c_str(), nullptr) != value) continue;
    const std::size_t exponent = text.find('e');
    if (exponent != std::string::npos && text.find('.') == std::string::npos) {
      text.insert(exponent, ".0");
    }
    return text;
  }
  return std::to_string(value);
}

std::string with_unit(const std::string& value, const std::string& unit) {
  return unit.empty() ? value : value + " " + unit;
}

std::string range_text(const Parameter& parameter) {
  switch (parameter.type) {
    case Parameter::Type::boolean:
      return "true, false";
    case Parameter::Type::choice: {
      std::string text;
      for (const std::string& choice : parameter.choices)
        text += (text.empty() ? "" : ", ") + choice;
      return text;
    }
    case Parameter::Type::integer:
    case Parameter::Type::real:
      break;
  }
  return (parameter.minimum_excluded ? "(" : "[") + shortest_text(parameter.minimum) + ", " +
         shortest_text(parameter.maximum) + "]";
}

// A value, or a name, may be any text; what is said of it is one short line.
constexpr std::size_t kLongestQuote = 100;
std::string quoted(std::string text) {
  if (text.size() > kLongestQuote) {
    text = text.substr(0, kLongestQuote) + "... (" + std::to_string(text.size()) + " characters)";
  }
  for (char& letter : text) {
    if (std::iscntrl(static_cast<unsigned char>(letter)) != 0) letter = ' ';
  }
  return text;
}

[[noreturn]] void refuse(const Parameter& parameter, const std::string& value) {
  const bool is_list =
      parameter.type == Parameter::Type::choice || parameter.type == Parameter::Type::boolean;
  const bool is_integer = parameter.type == Parameter::Type::integer;
  throw Error("parameter " + parameter.name + " is '" + quoted(value) + "', has to be " +
              (is_list ? "one of " : (is_integer ? "a whole number in " : "in ")) +
              with_unit(range_text(parameter), parameter.unit));
}

// Of what has to be above a limit: squares of it, and ratios of squares, are numbers still.
constexpr double kSmallestAbove = 1e-12;

double parse_number(const Parameter& parameter, const std::string& text) {
  const char* begin = text.c_str();
  char* end = nullptr;
  const double value = std::strtod(begin, &end);
  const std::size_t used = static_cast<std::size_t>(end - begin);
  const bool is_whole = used > 0 && text.find_first_not_of(' ', used) == std::string::npos;
  if (!is_whole || !std::isfinite(value)) refuse(parameter, text);
  const bool below =
      parameter.minimum_excluded ? value <= parameter.minimum : value < parameter.minimum;
  if (below || value > parameter.maximum) refuse(parameter, text);
  if (parameter.minimum_excluded && value - parameter.minimum < kSmallestAbove) {
    throw Error("parameter " + parameter.name + " is '" + quoted(text) +
                "', too close to its lower limit; use " +
                shortest_text(parameter.minimum + kSmallestAbove) + " or more");
  }
  return value;
}

// Quotes what is not a word, and what readers of YAML 1.1 take for something else.
std::string quoted_for_yaml(const std::string& word) {
  const bool is_plain = !word.empty() && std::all_of(word.begin(), word.end(), [](char character) {
    return std::isalnum(static_cast<unsigned char>(character)) != 0 || character == '_' ||
           character == '/' || character == '.';
  });
  if (!is_plain) {
    std::string quoted = "'";
    for (const char character : word)
      quoted += character == '\'' ? "''" : std::string(1, character);
    return quoted + "'";
  }
  for (const char* other : {"y", "n", "yes", "no", "on", "off", "true", "false", "null", "~"}) {
    if (word == other) return '"' + word + '"';
  }
  return word;
}

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0 : 1)});
      diagonal = above;
    }
  }
  return row[b.size()];
}

std::string remedy_for_unknown(const ParameterList& parameters, const std::string& name) {
  if (name.size() > kLongestQuote) return "leave it out";
  const auto former = former_parameters().find(name);
  if (former != former_parameters().end()) {
    return "it is fixed at " + former->second + "; leave it out";
  }
  const Parameter* nearest = nullptr;
  std::size_t least = name.size() / 2 + 1;
  for (const Parameter& parameter : parameters) {
    const std::size_t distance = edit_distance(parameter.name, name);
    if (distance >= least) continue;
    nearest = &parameter;
    least = distance;
  }
  return nearest != nullptr ? "did you mean " + nearest->name + "?" : "leave it out";
}

// A copy of the description without the accessors, for messages raised from within them.
Parameter description(std::string name, Parameter::Type type, std::string unit, std::string help,
                      double minimum, double maximum) {
  Parameter parameter;
  parameter.name = std::move(name);
  parameter.type = type;
  parameter.unit = std::move(unit);
  parameter.help = std::move(help);
  parameter.minimum = minimum;
  parameter.maximum = maximum;
  return parameter;
}

Parameter bind_real(Parameter parameter, double* field) {
  parameter.get = [field] { return shortest_text(*field); };
  parameter.set_checked = [field, plain = parameter](const std::string& text) {
    *field = parse_number(plain, text);
  };
  return parameter;
}

std::string comment_on(const Parameter& parameter) {
  const std::string range = with_unit(range_text(parameter), parameter.unit);
  return "# " + parameter.help + (range.empty() ? "" : " " + range);
}

// Each with its comment, `mark` before the name.
std::string lines_of(const ParameterList& parameters, const char* mark) {
  std::string text;
  bool was_basic = false;
  for (const Parameter& parameter : parameters) {
    if (was_basic && !parameter.is_basic) text += "# ---- For experts ----\n";
    was_basic = parameter.is_basic;
    const bool is_word = parameter.type == Parameter::Type::choice;
    text += comment_on(parameter) + "\n" + mark + parameter.name + ": " +
            (is_word ? quoted_for_yaml(parameter.get()) : parameter.get()) + "\n";
  }
  return text;
}

}  // namespace

Parameter boolean_parameter(std::string name, bool* field, std::string help) {
  Parameter parameter =
      description(std::move(name), Parameter::Type::boolean, "", std::move(help), 0.0, 1.0);
  parameter.get = [field] { return *field ? "true" : "false"; };
  parameter.set_checked = [field, plain = parameter](const std::string& text) {
    const bool is_true = text == "true" || text == "1";
    if (!is_true && text != "false" && text != "0") refuse(plain, text);
    *field = is_true;
  };
  return parameter;
}

Parameter integer_parameter(std::string name, int* field, int minimum, int maximum,
                            std::string help) {
  Parameter parameter =
      description(std::move(name), Parameter::Type::integer, "", std::move(help), minimum, maximum);
  parameter.get = [field] { return std::to_string(*field); };
  parameter.set_checked = [field, plain = parameter](const std::string& text) {
    const double value = parse_number(plain, text);
    if (value != std::floor(value)) refuse(plain, text);
    *field = static_cast<int>(value);
  };
  return parameter;
}

Parameter real_parameter(std::string name, double* field, double minimum, double maximum,
                         std::string unit, std::string help) {
  return bind_real(description(std::move(name), Parameter::Type::real, std::move(unit),
                               std::move(help), minimum, maximum),
                   field);
}

Parameter real_above_parameter(std::string name, double* field, double minimum, double maximum,
                               std::string unit, std::string help) {
  Parameter parameter = description(std::move(name), Parameter::Type::real, std::move(unit),
                                    std::move(help), minimum, maximum);
  parameter.minimum_excluded = true;
  return bind_real(std::move(parameter), field);
}

Parameter make_choice_parameter(std::string name, std::vector<std::string> choices,
                                std::string help, std::function<std::string()> get,
                                std::function<void(const std::string&)> assign) {
  Parameter parameter =
      description(std::move(name), Parameter::Type::choice, "", std::move(help), 0.0, 0.0);
  parameter.choices = std::move(choices);
  parameter.get = std::move(get);
  parameter.set_checked = [plain = parameter, assign = std::move(assign)](const std::string& text) {
    const auto is_choice = [&](const std::string& word) {
      return std::find(plain.choices.begin(), plain.choices.end(), word) != plain.choices.end();
    };
    // An unquoted `off` comes from the parameter server as a truth value.
    const bool is_off = text == "false" && !is_choice(text) && is_choice("off");
    if (!is_off && !is_choice(text)) refuse(plain, text);
    assign(is_off ? "off" : text);
  };
  return parameter;
}

Parameter text_parameter(std::string name, std::string* field, std::string help) {
  Parameter parameter =
      description(std::move(name), Parameter::Type::choice, "", std::move(help), 0.0, 0.0);
  parameter.get = [field] { return *field; };
  parameter.set_checked = [field](const std::string& text) { *field = text; };
  return parameter;
}

Parameter name_parameter(std::string name, std::string* field, std::string help) {
  Parameter parameter = text_parameter(std::move(name), field, std::move(help));
  parameter.set_checked = [name = parameter.name, field](const std::string& text) {
    if (text.empty()) throw Error("parameter " + name + " is empty, has to be a name");
    *field = text;
  };
  return parameter;
}

Parameter basic(Parameter parameter) {
  parameter.is_basic = true;
  return parameter;
}

ParameterList basic_first(ParameterList parameters) {
  std::stable_partition(parameters.begin(), parameters.end(),
                        [](const Parameter& parameter) { return parameter.is_basic; });
  return parameters;
}

const char* type_text(Parameter::Type type) {
  switch (type) {
    case Parameter::Type::boolean:
      return "bool";
    case Parameter::Type::integer:
      return "int";
    case Parameter::Type::real:
      return "double";
    case Parameter::Type::choice:
      return "string";
  }
  return "";
}

void set_parameter(const ParameterList& parameters, const std::string& name,
                   const std::string& value) {
  for (const Parameter& parameter : parameters) {
    if (parameter.name == name) return parameter.set_checked(value);
  }
  throw Error("parameter " + quoted(name) + " is unknown; " + remedy_for_unknown(parameters, name));
}

void set_parameters(const ParameterList& parameters,
                    const std::map<std::string, std::string>& values) {
  for (const auto& [name, value] : values) set_parameter(parameters, name, value);
}

void check_values(const ParameterList& parameters) {
  for (const Parameter& parameter : parameters) parameter.set_checked(parameter.get());
}

std::string to_yaml(const ParameterList& parameters) {
  return lines_of(parameters, "");
}

std::string to_template(const ParameterList& parameters) {
  return lines_of(parameters, "#");
}

std::string to_markdown(const ParameterList& parameters, const ParameterList& live) {
  std::ostringstream table;
  table << "| parameter | for | type | default | unit | range | meaning | changes |\n"
           "|---|---|---|---|---|---|---|---|\n";
  for (const Parameter& parameter : parameters) {
    const bool is_live = std::any_of(live.begin(), live.end(), [&](const Parameter& other) {
      return other.name == parameter.name;
    });
    table << "| `" << parameter.name << "` | " << (parameter.is_basic ? "basic" : "expert") << " | "
          << type_text(parameter.type) << " | " << parameter.get() << " | " << parameter.unit
          << " | " << range_text(parameter) << " | " << parameter.help << " | "
          << (is_live ? "live" : "at start") << " |\n";
  }
  return table.str();
}

}  // namespace pf_resampling
