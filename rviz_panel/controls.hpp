#pragma once

#include <dynamic_reconfigure/Config.h>
#include <dynamic_reconfigure/ConfigDescription.h>

#include <string>
#include <vector>

namespace pf_resampling {

/// What a parameter is set with, as a dynamic_reconfigure server describes it.
struct Control {
  enum class Kind { boolean, integer, real, choice, text };
  struct Choice {
    std::string name, value, help;
  };

  std::string name;   ///< of the parameter
  std::string label;  ///< the name without its group, to be read
  Kind kind = Kind::text;
  std::string type;  ///< the server's: bool, int, double or str; choices have one, too
  double minimum = 0.0, maximum = 0.0;  ///< of integers and reals
  std::vector<Choice> choices;
  std::string help;
  std::string initial;  ///< the value that the server started with
};

struct ControlGroup {
  std::string name, label;
  int parent = -1;  ///< index among the groups; -1: at the top
  std::vector<Control> controls;
};

/// The groups of a description, parents before children; the group of what has no group is the
/// first.
std::vector<ControlGroup> controls_of(const dynamic_reconfigure::ConfigDescription& description);

/// The request that sets one parameter to a value, given as text. Throws Error if the text is not
/// of the parameter's type.
dynamic_reconfigure::Config request_of(const Control& control, const std::string& value);

/// What is shown when the mouse rests on a control: name, help, range, value at the start.
std::string tooltip_of(const Control& control);

}  // namespace pf_resampling
