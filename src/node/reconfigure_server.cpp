#include "src/node/reconfigure_server.hpp"

#include <dynamic_reconfigure/config_tools.h>

#include <cstdio>
#include <cstdlib>
#include <stdexcept>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

using dynamic_reconfigure::Config;
using dynamic_reconfigure::ConfigDescription;

// "population/resampling/scheme" -> "population/resampling"; "" for a name without groups.
std::string group_of(const std::string& name) {
  const std::size_t slash = name.rfind('/');
  return slash == std::string::npos ? "" : name.substr(0, slash);
}

// The choices as dynamic_reconfigure wants them: a Python expression.
std::string edit_method_of(const Parameter& parameter) {
  if (parameter.choices.empty()) return "";
  std::string text;
  for (const std::string& choice : parameter.choices) {
    text += (text.empty() ? "" : ", ");
    text += "{'name': '" + choice + "', 'type': 'str', 'value': '" + choice +
            "', 'description': '', 'srcline': 0, 'srcfile': '', 'ctype': 'std::string', "
            "'cconsttype': 'const char * const'}";
  }
  return "{'enum_description': '" + parameter.name + "', 'enum': [" + text + "]}";
}

void add(const std::string& name, Parameter::Type type, const std::string& value, Config* config) {
  using dynamic_reconfigure::ConfigTools;
  switch (type) {
    case Parameter::Type::boolean:
      return ConfigTools::appendParameter(*config, name, value == "true");
    case Parameter::Type::integer:
      return ConfigTools::appendParameter(*config, name, std::atoi(value.c_str()));
    case Parameter::Type::real:
      return ConfigTools::appendParameter(*config, name, std::strtod(value.c_str(), nullptr));
    case Parameter::Type::choice:
      return ConfigTools::appendParameter(*config, name, value);
  }
}

std::string number_as_text(double value) {
  char text[40];
  std::snprintf(text, sizeof(text), "%.17g", value);
  return text;
}

// Ranges of booleans and choices are the whole of them.
std::string limit_text(const Parameter& parameter, bool upper) {
  switch (parameter.type) {
    case Parameter::Type::boolean:
      return upper ? "true" : "false";
    case Parameter::Type::integer:
    case Parameter::Type::real:
      return number_as_text(upper ? parameter.maximum : parameter.minimum);
    case Parameter::Type::choice:
      return "";
  }
  return "";
}

// A group for every prefix, each once, parents first; ids count from the root's 0.
std::vector<dynamic_reconfigure::Group> groups_of(const ParameterList& parameters) {
  std::vector<dynamic_reconfigure::Group> groups;
  std::map<std::string, std::size_t> index;
  const std::function<std::size_t(const std::string&)> find =
      [&](const std::string& name) -> std::size_t {
    const auto known = index.find(name);
    if (known != index.end()) return known->second;
    const std::size_t parent = name.empty() ? 0 : find(group_of(name));
    dynamic_reconfigure::Group group;
    group.name = name.empty() ? "Default" : name;
    group.id = static_cast<int>(groups.size());
    group.parent = static_cast<int>(parent);
    groups.push_back(group);
    index[name] = groups.size() - 1;
    return groups.size() - 1;
  };
  find("");
  for (const Parameter& parameter : parameters) {
    dynamic_reconfigure::ParamDescription description;
    description.name = parameter.name;
    description.type =
        parameter.type == Parameter::Type::choice ? "str" : type_text(parameter.type);
    description.description =
        parameter.help + (parameter.unit.empty() ? "" : " [" + parameter.unit + "]");
    description.level = parameter.is_basic ? kBasicLevel : kExpertLevel;
    description.edit_method = edit_method_of(parameter);
    groups[find(group_of(parameter.name))].parameters.push_back(description);
  }
  return groups;
}

void add_group_states(const ParameterList& parameters, Config* config) {
  dynamic_reconfigure::GroupState open;
  open.state = 1;
  for (const dynamic_reconfigure::Group& group : groups_of(parameters)) {
    dynamic_reconfigure::ConfigTools::appendGroup(*config, group.name, group.id, group.parent,
                                                  open);
  }
}

}  // namespace

ConfigDescription to_description(const ParameterList& parameters) {
  ConfigDescription description;
  description.groups = groups_of(parameters);
  for (const Parameter& parameter : parameters) {
    add(parameter.name, parameter.type, limit_text(parameter, false), &description.min);
    add(parameter.name, parameter.type, limit_text(parameter, true), &description.max);
    add(parameter.name, parameter.type, parameter.get(), &description.dflt);
  }
  for (Config* config : {&description.min, &description.max, &description.dflt}) {
    add_group_states(parameters, config);
  }
  return description;
}

Config to_config(const ParameterList& parameters) {
  Config config;
  for (const Parameter& parameter : parameters) {
    add(parameter.name, parameter.type, parameter.get(), &config);
  }
  add_group_states(parameters, &config);
  return config;
}

std::map<std::string, std::string> values_of(const Config& config) {
  std::map<std::string, std::string> values;
  for (const auto& entry : config.bools) values[entry.name] = entry.value != 0 ? "true" : "false";
  for (const auto& entry : config.ints) values[entry.name] = std::to_string(entry.value);
  for (const auto& entry : config.doubles) values[entry.name] = number_as_text(entry.value);
  for (const auto& entry : config.strs) values[entry.name] = entry.value;
  return values;
}

ReconfigureServer::ReconfigureServer(
    const ros::NodeHandle& private_node, std::function<ParameterList()> parameters,
    std::function<void(const std::map<std::string, std::string>&)> set)
    : node_(private_node), parameters_(std::move(parameters)), set_(std::move(set)) {
  descriptions_ = node_.advertise<ConfigDescription>("parameter_descriptions", 1, true);
  updates_ = node_.advertise<Config>("parameter_updates", 1, true);
  service_ = node_.advertiseService("set_parameters", &ReconfigureServer::take, this);
  descriptions_.publish(to_description(parameters_()));
  publish();
}

void ReconfigureServer::publish() {
  const Config config = to_config(parameters_());
  for (const auto& entry : config.bools) node_.setParam(entry.name, entry.value != 0);
  for (const auto& entry : config.ints) node_.setParam(entry.name, entry.value);
  for (const auto& entry : config.doubles) node_.setParam(entry.name, entry.value);
  for (const auto& entry : config.strs) node_.setParam(entry.name, entry.value);
  updates_.publish(config);
}

bool ReconfigureServer::take(dynamic_reconfigure::Reconfigure::Request& request,
                             dynamic_reconfigure::Reconfigure::Response& response) {
  try {
    set_(values_of(request.config));
  } catch (const Error& error) {
    publish();
    // What is thrown here is logged, and told to the caller.
    throw std::runtime_error(std::string("parameters not changed: ") + error.what());
  }
  publish();
  response.config = to_config(parameters_());
  return true;
}

}  // namespace pf_resampling
