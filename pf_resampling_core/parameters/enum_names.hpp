#pragma once

#include <string>
#include <utility>
#include <vector>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {

/// The names of an enum's values as users write them: the one table behind to_string, parsing,
/// parameters and error messages. Beside the enum stands
///     const EnumNames<Schedule>& names_of(Schedule);
/// and the functions below follow from it.
template <typename Enum>
class EnumNames {
 public:
  EnumNames(std::string what, std::vector<std::pair<Enum, std::string>> names)
      : what_(std::move(what)), names_(std::move(names)) {
    for (const auto& entry : names_) values_.push_back(entry.first);
  }

  const std::vector<Enum>& values() const { return values_; }

  const std::string& name(Enum value) const {
    for (const auto& [known, text] : names_) {
      if (known == value) return text;
    }
    throw Error(what_ + " " + std::to_string(static_cast<int>(value)) + " has no name");
  }

  /// Throws Error that lists the known names when `name` is none of them.
  Enum value(const std::string& name) const {
    std::string known_names;
    for (const auto& [value, text] : names_) {
      if (text == name) return value;
      known_names += (known_names.empty() ? "" : ", ") + text;
    }
    throw Error("unknown " + what_ + " '" + name + "'; known are " + known_names);
  }

 private:
  std::string what_;
  std::vector<std::pair<Enum, std::string>> names_;
  std::vector<Enum> values_;
};

/// All values, in the order of the table.
template <typename Enum>
const std::vector<Enum>& all_values() {
  return names_of(Enum()).values();
}

template <typename Enum>
auto to_string(Enum value) -> decltype(names_of(value).name(value)) {
  return names_of(value).name(value);
}

/// Throws Error that lists the known names when `name` is none of them.
template <typename Enum>
Enum from_string(const std::string& name) {
  return names_of(Enum()).value(name);
}

}  // namespace pf_resampling
