#include "tools/worlds/world_file.hpp"

#include <yaml-cpp/yaml.h>

#include <boost/algorithm/string/join.hpp>
#include <map>
#include <set>

#include "pf_resampling_core/error.hpp"
#include "src/configuration/configuration.hpp"
#include "tools/common/files.hpp"
#include "tools/worlds/builtin_worlds.hpp"

namespace pf_resampling {
namespace {

/// Reads a world from YAML; errors name source, line and the keys that lead to a value.
class WorldReader {
 public:
  WorldReader(const std::string& source, World* world) : source_(source), world_(world) {}

  void read(const YAML::Node& file) {
    const std::map<std::string, double*> numbers = numbers_of(world_);
    each_key(file, "the file", "", [&](const std::string& key, const YAML::Node& value) {
      if (key == "repeat") return read_as(value, key, "true or false", &world_->repeat);
      if (key == "waypoints") return read_points(value, key, &world_->waypoints);
      if (key == "landmarks") return read_points(value, key, &world_->landmarks);
      if (key.rfind("closure_", 0) == 0) {
        return read_as(value, key, "a whole number", &world_->closures[key.substr(8)]);
      }
      // What a study runs on the world, and what a picture shows of it, is no part of it; beacons
      // come when the antenna is known.
      const std::set<std::string> others = {"filter", "area", "beacons"};
      if (others.count(key) == 0) read_number(value, key, numbers);
    });
    // A robot's odometry comes with its controls unless it is said.
    if (file["robot"] && (!file["odometry"] || !file["odometry"]["period"])) {
      world_->odometry.period = world_->drive.control_period;
    }
    if (file["beacons"]) {
      for (const YAML::Node& beacon : list(file["beacons"], "beacons")) read_beacon(beacon);
    }
  }

 private:
  [[noreturn]] void fail(const YAML::Node& node, const std::string& problem) const {
    throw Error(source_ + ", line " + std::to_string(node.Mark().line + 1) + ": " +
                one_line(problem));
  }
  static std::string text(const YAML::Node& node) {
    return node.IsScalar() ? node.Scalar() : std::string("a list or map");
  }

  template <typename Take>
  void each_key(const YAML::Node& map, const std::string& name, const std::string& path,
                const Take& take) const {
    if (!map.IsMap()) fail(map, name + " has to be a map of keys");
    std::set<std::string> keys;
    for (const auto& item : map) {
      const std::string key = path + text(item.first);
      if (!keys.insert(key).second) fail(item.first, key + " is there twice");
      take(key, item.second);
    }
  }

  // A number, or a map of them.
  void read_number(const YAML::Node& node, const std::string& key,
                   const std::map<std::string, double*>& numbers) const {
    const auto number = numbers.find(key);
    if (number != numbers.end()) return read_as(node, key, "a number", number->second);
    const auto inside = numbers.lower_bound(key + "/");
    if (inside == numbers.end() || inside->first.rfind(key + "/", 0) != 0) {
      std::string known;
      for (const auto& [name, value] : numbers) known += (known.empty() ? "" : ", ") + name;
      fail(node, key + " is unknown; known: " + known);
    }
    each_key(node, key, key + "/", [&](const std::string& name, const YAML::Node& value) {
      read_number(value, name, numbers);
    });
  }

  template <typename Value>
  void read_as(const YAML::Node& node, const std::string& key, const char* kind,
               Value* value) const {
    if (node.IsScalar() && YAML::convert<Value>::decode(node, *value)) return;
    fail(node, key + " is \"" + text(node) + "\", needed: " + kind);
  }

  YAML::Node list(const YAML::Node& node, const std::string& key) const {
    if (!node.IsSequence()) fail(node, key + " has to be a list");
    return node;
  }

  void read_points(const YAML::Node& node, const std::string& key,
                   std::vector<Eigen::Vector2d>* points) const {
    for (const YAML::Node& item : list(node, key)) {
      if (!item.IsSequence() || item.size() != 2) fail(item, key + " has to be pairs [x, y]");
      Eigen::Vector2d point;
      for (int i : {0, 1}) read_as(item[i], key, "a number", &point[i]);
      if (!point.allFinite()) fail(item, key + " has a coordinate that is not finite");
      points->push_back(point);
    }
  }

  void require(const YAML::Node& map, const std::string& name,
               const std::vector<const char*>& keys) const {
    for (const char* key : keys) {
      if (!map[key]) fail(map, name + "/" + key + " is missing");
    }
  }

  void read_beacon(const YAML::Node& node) {
    SimulatedBeacon beacon;
    Eigen::Vector3d& position = beacon.beacon.position;
    position.z() = world_->ranges.antenna.z();
    const std::map<std::string, double*> numbers = {
        {"beacons/x", &position.x()},          {"beacons/y", &position.y()},
        {"beacons/z", &position.z()},          {"beacons/scale", &beacon.errors.scale},
        {"beacons/bias", &beacon.errors.bias}, {"beacons/sigma", &beacon.errors.sigma}};
    each_key(node, "beacons", "beacons/", [&](const std::string& key, const YAML::Node& value) {
      if (key == "beacons/id") return read_as(value, key, "a whole number", &beacon.beacon.id);
      read_number(value, key, numbers);
    });
    require(node, "beacons", {"id", "x", "y"});
    world_->beacons.push_back(beacon);
  }

  const std::string& source_;
  World* world_;
};

}  // namespace

std::vector<std::string> builtin_worlds() {
  std::vector<std::string> names;
  for (const auto& [name, text] : builtin_world_texts()) names.push_back(name);
  return names;
}

World parse_world(const std::string& text, const std::string& source) {
  World world;
  try {
    WorldReader(source, &world).read(YAML::Load(text));
  } catch (const YAML::Exception& error) {
    throw Error(source + ", line " + std::to_string(error.mark.line + 1) +
                ": not YAML: " + one_line(error.msg));
  }
  try {
    check_world(world);
  } catch (const Error& error) {
    throw Error(source + ": " + error.what());
  }
  return world;
}

World load_world(const std::string& name_or_path) {
  const auto builtin = builtin_world_texts().find(name_or_path);
  if (builtin != builtin_world_texts().end()) {
    return parse_world(builtin->second, name_or_path);
  }
  if (name_or_path.find('/') == std::string::npos && name_or_path.find('.') == std::string::npos) {
    throw Error("world \"" + name_or_path +
                "\" is unknown; known: " + boost::algorithm::join(builtin_worlds(), ", ") +
                ", or the path of a world's YAML file");
  }
  return parse_world(read_file(name_or_path), name_or_path);
}

}  // namespace pf_resampling
