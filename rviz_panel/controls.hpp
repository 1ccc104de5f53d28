#pragma once

#include <dynamic_reconfigure/Config.h>
#include <dynamic_reconfigure/ConfigDescription.h>

#include <string>
#include <vector>

namespace pf_resampling {

/// What a parameter is set with, as a dynamic_reconfigure server describes it.
struct Control {
  std::string name;                  ///< of the parameter
  std::vector<std::string> choices;  ///< all values that there are; empty: too many to list
  std::string help;                  ///< with the range
};

/// The parameters for everybody, in their order; those for experts have another level.
std::vector<Control> basic_controls(const dynamic_reconfigure::ConfigDescription& description);

/// The request that sets one parameter to a value. All go as text: the node knows what it has to
/// be, and says so.
dynamic_reconfigure::Config request_of(const std::string& name, const std::string& value);

}  // namespace pf_resampling
