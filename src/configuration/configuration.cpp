#include "src/configuration/configuration.hpp"

#include <yaml-cpp/yaml.h>

#include <boost/algorithm/string/join.hpp>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <system_error>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/files/text_file.hpp"
#include "src/messages/conversions.hpp"

namespace pf_resampling {
namespace {

/// An element of one of the lists: key -> value as text, and where it stands.
struct Entry {
  std::map<std::string, std::string> fields;
  std::string where;
};

double number_of(const Entry& entry, const std::string& key) {
  const std::string& text = entry.fields.at(key);
  double value = 0.0;
  if (!text_file::parse(text, &value)) {
    throw Error(entry.where + ": " + key + " is '" + text + "'; it has to be a finite number");
  }
  return value;
}

int id_of(const Entry& entry, const std::string& key) {
  const double value = number_of(entry, key);
  if (value != std::floor(value) || std::abs(value) > 2147483647.0) {
    throw Error(entry.where + ": " + key + " is '" + entry.fields.at(key) +
                "'; it has to be an integer");
  }
  return static_cast<int>(value);
}

/// "id, x, y and, if wanted, frame, z".
std::string list_of_keys(const std::set<std::string>& needed,
                         const std::set<std::string>& optional) {
  using boost::algorithm::join;
  return join(needed, ", ") + (optional.empty() ? "" : " and, if wanted, " + join(optional, ", "));
}

void check_keys(const Entry& entry, const std::set<std::string>& needed,
                const std::set<std::string>& optional) {
  const std::string known = "; the keys are " + list_of_keys(needed, optional);
  for (const auto& [key, value] : entry.fields) {
    if (needed.count(key) == 0 && optional.count(key) == 0) {
      throw Error(entry.where + ": unknown key '" + key + "'" + known);
    }
  }
  for (const std::string& key : needed) {
    if (entry.fields.count(key) == 0) {
      throw Error(entry.where + ": '" + key + "' is missing" + known);
    }
  }
}

double number_or(const Entry& entry, const std::string& key, double otherwise) {
  return entry.fields.count(key) == 0 ? otherwise : number_of(entry, key);
}

double sigma_of(const Entry& entry) {
  const double sigma = number_or(entry, "sigma", 0.0);
  if (sigma >= 0.0) return sigma;
  throw Error(entry.where + ": sigma is '" + entry.fields.at("sigma") +
              "'; it has to be 0 or more (m; 0: the model's own)");
}

void add_entry(const std::string& list, const Entry& entry, Configuration* configuration) {
  if (list == "beacons") {
    check_keys(entry, {"id", "x", "y"}, {"z", "frame", "sigma"});
    Beacon beacon;
    beacon.id = id_of(entry, "id");
    beacon.position = {number_of(entry, "x"), number_of(entry, "y"), number_or(entry, "z", 0.0)};
    beacon.is_planar = entry.fields.count("z") == 0;
    beacon.sigma = sigma_of(entry);
    for (const Beacon& other : configuration->beacons) {
      if (other.id != beacon.id) continue;
      throw Error(entry.where + ": beacon " + std::to_string(beacon.id) + " appears twice");
    }
    const auto frame = entry.fields.find("frame");
    if (frame != entry.fields.end() &&
        !configuration->beacon_frames.emplace(without_slash(frame->second), beacon.id).second) {
      throw Error(entry.where + ": the frame '" + frame->second + "' appears twice");
    }
    configuration->beacons.push_back(beacon);
  } else if (list == "calibration") {
    check_keys(entry, {"beacon"}, {"scale", "bias", "sigma"});
    RangeCalibration calibration;
    calibration.scale = number_or(entry, "scale", 1.0);
    calibration.bias = number_or(entry, "bias", 0.0);
    calibration.sigma = sigma_of(entry);
    if (calibration.scale <= 0.0) {
      throw Error(entry.where + ": scale is '" + entry.fields.at("scale") +
                  "'; it has to be above 0");
    }
    configuration->calibration[id_of(entry, "beacon")] = calibration;
  } else if (list == "sensors") {
    check_keys(entry, {"frame", "x", "y"}, {"yaw"});
    configuration->sensors[entry.fields.at("frame")] = {
        number_of(entry, "x"), number_of(entry, "y"), number_or(entry, "yaw", 0.0)};
  } else {
    check_keys(entry, {"frame", "x", "y"}, {"z"});
    configuration->antennas[entry.fields.at("frame")] = {
        number_of(entry, "x"), number_of(entry, "y"), number_or(entry, "z", 0.0)};
  }
}

bool is_list_name(const std::string& name) {
  return name == "beacons" || name == "calibration" || name == "antennas" || name == "sensors";
}

/// What errors call the value of a name: "beacons.yaml:3: 'particles'"; without a file, it is a
/// parameter of the node.
std::string place_of(const std::string& file, const YAML::Node& node, const std::string& name) {
  if (file.empty()) return "parameter '" + name + "'";
  return file + ":" + std::to_string(node.Mark().line + 1) + ": '" + name + "'";
}

void flatten(const std::string& file, const std::string& prefix, const YAML::Node& node,
             Configuration* configuration) {
  for (const auto& item : node) {
    if (!item.first.IsScalar()) {
      throw Error(place_of(file, item.first, prefix) + " has a name that is none");
    }
    const std::string name = prefix + item.first.Scalar();
    const YAML::Node& value = item.second;
    // `calibration` is also a group of parameters: a map is the group, a list the known
    // calibration.
    if (is_list_name(name) && !(name == "calibration" && value.IsMap())) {
      if (!value.IsSequence()) throw Error(place_of(file, value, name) + " has to be a list");
      int count = 0;
      for (const YAML::Node& element : value) {
        Entry entry;
        entry.where = place_of(file, element, name) + ", element " + std::to_string(count++);
        if (!element.IsMap()) {
          throw Error(entry.where + ": an element has to be {key: value, ...}");
        }
        for (const auto& field : element) {
          // What is no word or number is none of the values of a key; as a key it is unknown.
          entry.fields[field.first.IsScalar() ? field.first.Scalar() : "a list"] =
              field.second.IsScalar() ? field.second.Scalar() : "a list";
        }
        add_entry(name, entry, configuration);
      }
    } else if (value.IsMap()) {
      flatten(file, name + "/", value, configuration);
    } else if (!value.IsScalar()) {
      throw Error(place_of(file, item.first, name) +
                  " has a value that is not a number, a word, true or false");
    } else if (!configuration->values.emplace(name, value.Scalar()).second) {
      throw Error(place_of(file, item.first, name) + " is there twice; give it once");
    }
  }
}

/// Of the parameter server; what YAML has no word for is null.
YAML::Node to_yaml(XmlRpc::XmlRpcValue value) {
  YAML::Node node;
  switch (value.getType()) {
    case XmlRpc::XmlRpcValue::TypeBoolean:
      return YAML::Node(static_cast<bool>(value) ? "true" : "false");
    case XmlRpc::XmlRpcValue::TypeInt:
      return YAML::Node(std::to_string(static_cast<int>(value)));
    case XmlRpc::XmlRpcValue::TypeDouble: {
      char text[40];
      std::snprintf(text, sizeof(text), "%.17g", static_cast<double>(value));
      return YAML::Node(text);
    }
    case XmlRpc::XmlRpcValue::TypeString:
      return YAML::Node(static_cast<std::string>(value));
    case XmlRpc::XmlRpcValue::TypeArray:
      node = YAML::Node(YAML::NodeType::Sequence);
      for (int i = 0; i < value.size(); ++i) node.push_back(to_yaml(value[i]));
      return node;
    case XmlRpc::XmlRpcValue::TypeStruct:
      node = YAML::Node(YAML::NodeType::Map);
      for (auto& item : value) node[item.first] = to_yaml(item.second);
      return node;
    default:
      return node;
  }
}

}  // namespace

Configuration parse_configuration(const std::string& text, const std::string& name) {
  Configuration configuration;
  try {
    const YAML::Node root = YAML::Load(text);
    if (root.IsNull()) return configuration;
    if (!root.IsMap()) throw Error(name + ": has to be a YAML map of parameters");
    flatten(name, "", root, &configuration);
  } catch (const YAML::Exception& error) {
    throw Error(name + ":" + std::to_string(error.mark.line + 1) + ":" +
                std::to_string(error.mark.column + 1) + ": not YAML: " + one_line(error.msg));
  } catch (const Error& error) {
    throw Error(one_line(error.what()));
  }
  return configuration;
}

Configuration read_configuration(const std::string& path) {
  // Opening a FIFO waits for somebody who writes into it. --config <(command) is a pipe that is
  // open.
  const bool is_open = path.rfind("/dev/fd/", 0) == 0 || path.rfind("/proc/self/fd/", 0) == 0;
  std::error_code unknown;
  if (!is_open && std::filesystem::exists(path, unknown) &&
      !std::filesystem::is_regular_file(path, unknown)) {
    throw Error(path + ": cannot be read, it is no regular file; copy it into one");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error(path + ": no such file, or it cannot be read");
  std::ostringstream text;
  text << file.rdbuf();
  if (text.bad()) throw Error(path + ": cannot be read to its end");
  return parse_configuration(text.str(), path);
}

Configuration configuration_of(const XmlRpc::XmlRpcValue& parameters) {
  Configuration configuration;
  flatten("", "", to_yaml(parameters), &configuration);
  return configuration;
}

std::string one_line(std::string text) {
  for (char& letter : text) {
    if (std::iscntrl(static_cast<unsigned char>(letter)) != 0) letter = ' ';
  }
  return text;
}

Configuration parse_assignment(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw Error("'" + text +
                "' is not an assignment; write name=value, for instance population/threshold=0.5");
  }
  Configuration configuration;
  configuration.values[text.substr(0, equals)] = text.substr(equals + 1);
  return configuration;
}

}  // namespace pf_resampling
