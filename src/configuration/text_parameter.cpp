#include "src/configuration/text_parameter.hpp"

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {

Parameter text_parameter(const std::string& name, std::string* field, const std::string& help) {
  Parameter parameter = make_choice_parameter(
      name, {}, help, [field] { return *field; }, nullptr);
  parameter.set_checked = [field](const std::string& text) { *field = text; };
  return parameter;
}

Parameter name_parameter(const std::string& name, std::string* field, const std::string& help) {
  Parameter parameter = text_parameter(name, field, help);
  parameter.set_checked = [name, field](const std::string& text) {
    if (text.empty()) throw Error("parameter " + name + " is empty, has to be a name");
    *field = text;
  };
  return parameter;
}

}  // namespace pf_resampling
