#pragma once

#include <dynamic_reconfigure/ConfigDescription.h>
#include <dynamic_reconfigure/Reconfigure.h>
#include <ros/ros.h>

#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "pf_resampling_core/parameters/parameters.hpp"

namespace pf_resampling {

/// Of the description of a parameter: for everybody, or for experts.
inline constexpr std::uint32_t kBasicLevel = 0, kExpertLevel = 1;

/// Parameters as dynamic_reconfigure sees them: types, ranges, choices, help texts, levels, in the
/// groups that their names say. Units stand in the help texts.
dynamic_reconfigure::ConfigDescription to_description(const ParameterList& parameters);

/// Their present values.
dynamic_reconfigure::Config to_config(const ParameterList& parameters);

/// The values that a request gives, by name and as text.
std::map<std::string, std::string> values_of(const dynamic_reconfigure::Config& config);

/// A dynamic_reconfigure server (what rqt_reconfigure and dynparam talk to) whose parameters are
/// described at run time: names, ranges and help have one home, the core's description, and no .cfg
/// file repeats them.
class ReconfigureServer {
 public:
  /// `parameters`: what can be set, with the present values. `set`: takes over all of the values or
  /// none; the Error it throws says why none. Then the old values stay and are shown, and the
  /// call fails.
  ReconfigureServer(const ros::NodeHandle& private_node, std::function<ParameterList()> parameters,
                    std::function<void(const std::map<std::string, std::string>&)> set);

  /// Says what holds now, after values changed otherwise.
  void publish();

 private:
  bool take(dynamic_reconfigure::Reconfigure::Request& request,
            dynamic_reconfigure::Reconfigure::Response& response);

  ros::NodeHandle node_;
  std::function<ParameterList()> parameters_;
  std::function<void(const std::map<std::string, std::string>&)> set_;
  ros::Publisher descriptions_, updates_;
  ros::ServiceServer service_;
};

}  // namespace pf_resampling
