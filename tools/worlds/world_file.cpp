#include "tools/worlds/world_file.hpp"

#include <yaml-cpp/yaml.h>

#include <set>

#include "pf_resampling_core/error.hpp"
#include "src/configuration/yaml_document.hpp"
#include "tools/common/files.hpp"
#include "tools/common/table.hpp"
#include "tools/worlds/builtin_worlds.hpp"
#include "tools/worlds/map_file.hpp"

namespace pf_resampling {
namespace {

// A map of the file, read key by key; afterwards, keys that nobody asked for are an error, so that
// a misspelt one never silently leaves a default in place.
class Section {
 public:
  Section(const YAML::Node& node, std::string source, std::string path)
      : node_(node), source_(std::move(source)), path_(std::move(path)) {
    if (!node_.IsMap()) fail(node_, path_.empty() ? "the file" : path_, "has to be a map of keys");
  }

  void read(const std::string& key, double* value) { read_as(key, value, "a number"); }
  void read(const std::string& key, int* value) { read_as(key, value, "a whole number"); }
  void read(const std::string& key, bool* value) { read_as(key, value, "true or false"); }

  void require(const std::string& key) const {
    if (!has(key)) fail(node_, name(key), "is missing");
  }

  /// Reads the map `key`, if there is one, by `reader`.
  template <typename Reader>
  void read_section(const std::string& key, Reader reader) {
    known_.insert(key);
    if (!has(key)) return;
    Section section(at(key), source_, name(key));
    reader(section);
    section.finish();
  }

  /// Reads each map of the list `key` by `reader`.
  template <typename Reader>
  void read_sections(const std::string& key, Reader reader) {
    for (const YAML::Node& item : list(key)) {
      Section section(item, source_, name(key));
      reader(section);
      section.finish();
    }
  }

  void read_points(const std::string& key, std::vector<Eigen::Vector2d>* points) {
    for (const YAML::Node& item : list(key)) {
      if (!item.IsSequence() || item.size() != 2) fail(item, name(key), "has to be pairs [x, y]");
      Eigen::Vector2d point;
      for (std::size_t i = 0; i < 2; ++i) {
        if (!YAML::convert<double>::decode(item[i], point(static_cast<Eigen::Index>(i)))) {
          fail(item[i], name(key), "has \"" + text(item[i]) + "\" where a number is needed");
        }
      }
      if (!point.allFinite()) fail(item, name(key), "has a coordinate that is not finite");
      points->push_back(point);
    }
  }

  /// Whole numbers under keys with a prefix, by the rest of the key.
  void read_prefixed(const std::string& prefix, std::map<std::string, int>* values) {
    for (const auto& item : node_) {
      const std::string key = text(item.first);
      if (key.compare(0, prefix.size(), prefix) != 0) continue;
      read(key, &(*values)[key.substr(prefix.size())]);
    }
  }

  void ignore(const std::string& key) { known_.insert(key); }

  void finish() const {
    for (const auto& item : node_) {
      const std::string key = text(item.first);
      if (known_.count(key) != 0) continue;
      fail(item.first, name(key),
           "is unknown; known here: " + joined({known_.begin(), known_.end()}, ", "));
    }
  }

 private:
  // Const, because yaml-cpp's other operator[] adds what it does not find.
  YAML::Node at(const std::string& key) const { return node_[key]; }
  bool has(const std::string& key) const { return node_[key].IsDefined(); }

  static std::string text(const YAML::Node& node) {
    return node.IsScalar() ? node.Scalar() : std::string("a list or map");
  }

  std::string name(const std::string& key) const { return path_.empty() ? key : path_ + "/" + key; }

  template <typename Value>
  void read_as(const std::string& key, Value* value, const std::string& kind) {
    known_.insert(key);
    if (!has(key)) return;
    const YAML::Node item = at(key);
    if (!YAML::convert<Value>::decode(item, *value)) {
      fail(item, name(key), "is \"" + text(item) + "\", needed: " + kind);
    }
  }

  YAML::Node list(const std::string& key) {
    known_.insert(key);
    if (!has(key)) return YAML::Node(YAML::NodeType::Sequence);
    const YAML::Node items = at(key);
    if (!items.IsSequence()) fail(items, name(key), "has to be a list");
    return items;
  }

  [[noreturn]] void fail(const YAML::Node& node, const std::string& what,
                         const std::string& problem) const {
    throw Error(source_ + ", line " + std::to_string(node.Mark().line + 1) + ": " +
                one_line(what + " " + problem));
  }

  YAML::Node node_;
  std::string source_;
  std::string path_;
  std::set<std::string> known_;
};

void read_robot(Section& robot, World* world) {
  DriveOptions& drive = world->drive;
  robot.read("speed", &drive.speed);
  robot.read("speed_floor", &drive.speed_floor);
  robot.read("yaw_rate_gain", &drive.yaw_rate_gain);
  robot.read("yaw_rate_limit", &drive.yaw_rate_limit);
  robot.read("reached_distance", &drive.reached_distance);
  robot.read("control_period", &drive.control_period);
  world->odometry.period = drive.control_period;
  robot.read_section("motion_noise", [&](Section& noise) {
    noise.read("speed", &world->odometry.speed_sigma);
    noise.read("lateral", &world->odometry.lateral_sigma);
    noise.read("yaw_rate", &world->odometry.yaw_rate_sigma);
  });
  robot.read("observation_period", &world->landmark_sensor.period);
  robot.read_section("sensor", [&](Section& sensor) {
    sensor.read("range_max", &world->landmark_sensor.range_max);
    sensor.read("field_of_view", &world->landmark_sensor.field_of_view);
    sensor.read("range_noise", &world->landmark_sensor.range_sigma);
    sensor.read("bearing_noise", &world->landmark_sensor.bearing_sigma);
  });
}

void read_odometry(Section& odometry, OdometryErrors* errors) {
  odometry.read("period", &errors->period);
  odometry.read("distance_scale", &errors->distance_scale);
  odometry.read("yaw_scale", &errors->yaw_scale);
  odometry.read("yaw_rate_bias", &errors->yaw_rate_bias);
  odometry.read("yaw_rate_bias_drift", &errors->yaw_rate_bias_drift);
}

void read_ranges(Section& ranges, RangeSensorOptions* options) {
  ranges.read("rate", &options->rate);
  ranges.read("range_max", &options->range_max);
  ranges.read("outlier_share", &options->outlier_share);
  ranges.read("outlier_max", &options->outlier_max);
  ranges.read("reflected_share", &options->reflected_share);
  ranges.read("reflected_excess_mean", &options->reflected_excess_mean);
  ranges.read_section("antenna", [&](Section& antenna) {
    antenna.read("x", &options->antenna.x());
    antenna.read("y", &options->antenna.y());
    antenna.read("z", &options->antenna.z());
  });
}

SimulatedBeacon read_beacon(Section& section, double default_z) {
  SimulatedBeacon beacon;
  for (const char* key : {"id", "x", "y"}) section.require(key);
  beacon.beacon.position.z() = default_z;
  section.read("id", &beacon.beacon.id);
  section.read("x", &beacon.beacon.position.x());
  section.read("y", &beacon.beacon.position.y());
  section.read("z", &beacon.beacon.position.z());
  section.read("scale", &beacon.errors.scale);
  section.read("bias", &beacon.errors.bias);
  section.read("sigma", &beacon.errors.sigma);
  return beacon;
}

World read_world(Section& file) {
  World world;
  file.read_section("area", [&](Section& area) {
    for (const char* key : {"x_min", "y_min", "x_max", "y_max"}) area.require(key);
    area.read("x_min", &world.area.x_min);
    area.read("y_min", &world.area.y_min);
    area.read("x_max", &world.area.x_max);
    area.read("y_max", &world.area.y_max);
  });
  file.read_section("start", [&](Section& start) {
    start.read("x", &world.start.x);
    start.read("y", &world.start.y);
    start.read("heading", &world.start.heading);
  });
  file.read("repeat", &world.repeat);
  file.read("duration", &world.duration);
  file.read_points("waypoints", &world.waypoints);
  file.read_prefixed("closure_", &world.closures);
  file.read_points("landmarks", &world.landmarks);
  file.read_section("robot", [&](Section& robot) { read_robot(robot, &world); });
  file.read_section("odometry", [&](Section& section) { read_odometry(section, &world.odometry); });
  file.read_section("ranges", [&](Section& section) { read_ranges(section, &world.ranges); });
  file.read_sections("beacons", [&](Section& beacon) {
    world.beacons.push_back(read_beacon(beacon, world.ranges.antenna.z()));
  });
  file.ignore("filter");  // what a study runs on the world; no part of the world
  file.finish();
  return world;
}

}  // namespace

std::vector<std::string> builtin_worlds() {
  std::vector<std::string> names;
  for (const auto& [name, text] : builtin_world_texts()) names.push_back(name);
  return names;
}

World parse_world(const std::string& text, const std::string& source) {
  YAML::Node root;
  try {
    root = parse_yaml(text);
  } catch (const YAML::Exception& error) {
    throw Error(source + ", line " + std::to_string(error.mark.line + 1) +
                ": not YAML: " + one_line(error.msg));
  }
  Section file(root, source, "");
  World world = read_world(file);
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
    World world = parse_world(builtin->second, name_or_path);
    world.name = name_or_path;
    return world;
  }
  if (name_or_path.find('/') == std::string::npos && name_or_path.find('.') == std::string::npos) {
    throw Error("world \"" + name_or_path +
                "\" is unknown; known: " + joined(builtin_worlds(), ", ") +
                ", or the path of a world's YAML file or of a map lm, wp (.mat)");
  }
  const std::size_t ending = name_or_path.rfind(".mat");
  if (ending != std::string::npos && ending + 4 == name_or_path.size()) {
    return load_map(name_or_path);
  }
  World world = parse_world(read_file(name_or_path), name_or_path);
  world.name = name_or_path;
  return world;
}

}  // namespace pf_resampling
