#include "tools/worlds/world_file.hpp"

#include "pf_resampling_core/error.hpp"
#include "src/configuration/yaml_section.hpp"
#include "tools/common/files.hpp"
#include "tools/common/table.hpp"
#include "tools/worlds/builtin_worlds.hpp"
#include "tools/worlds/map_file.hpp"

namespace pf_resampling {
namespace {

void read_robot(YamlSection& robot, World* world) {
  DriveOptions& drive = world->drive;
  robot.read("speed", &drive.speed);
  robot.read("speed_floor", &drive.speed_floor);
  robot.read("yaw_rate_gain", &drive.yaw_rate_gain);
  robot.read("yaw_rate_limit", &drive.yaw_rate_limit);
  robot.read("reached_distance", &drive.reached_distance);
  robot.read("control_period", &drive.control_period);
  world->odometry.period = drive.control_period;
  robot.read_section("motion_noise", [&](YamlSection& noise) {
    noise.read("speed", &world->odometry.speed_sigma);
    noise.read("lateral", &world->odometry.lateral_sigma);
    noise.read("yaw_rate", &world->odometry.yaw_rate_sigma);
  });
  robot.read("observation_period", &world->landmark_sensor.period);
  robot.read_section("sensor", [&](YamlSection& sensor) {
    sensor.read("range_max", &world->landmark_sensor.range_max);
    sensor.read("field_of_view", &world->landmark_sensor.field_of_view);
    sensor.read("range_noise", &world->landmark_sensor.range_sigma);
    sensor.read("bearing_noise", &world->landmark_sensor.bearing_sigma);
  });
}

void read_odometry(YamlSection& odometry, OdometryErrors* errors) {
  odometry.read("period", &errors->period);
  odometry.read("distance_scale", &errors->distance_scale);
  odometry.read("yaw_scale", &errors->yaw_scale);
  odometry.read("yaw_rate_bias", &errors->yaw_rate_bias);
  odometry.read("yaw_rate_bias_drift", &errors->yaw_rate_bias_drift);
}

void read_ranges(YamlSection& ranges, RangeSensorOptions* options) {
  ranges.read("rate", &options->rate);
  ranges.read("range_max", &options->range_max);
  ranges.read("outlier_share", &options->outlier_share);
  ranges.read("outlier_max", &options->outlier_max);
  ranges.read("reflected_share", &options->reflected_share);
  ranges.read("reflected_excess_mean", &options->reflected_excess_mean);
  ranges.read_section("antenna", [&](YamlSection& antenna) {
    antenna.read("x", &options->antenna.x());
    antenna.read("y", &options->antenna.y());
    antenna.read("z", &options->antenna.z());
  });
}

SimulatedBeacon read_beacon(YamlSection& section, double default_z) {
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

World read_world(YamlSection& file) {
  World world;
  file.read_section("area", [&](YamlSection& area) {
    for (const char* key : {"x_min", "y_min", "x_max", "y_max"}) area.require(key);
    area.read("x_min", &world.area.x_min);
    area.read("y_min", &world.area.y_min);
    area.read("x_max", &world.area.x_max);
    area.read("y_max", &world.area.y_max);
  });
  file.read_section("start", [&](YamlSection& start) {
    start.read("x", &world.start.x);
    start.read("y", &world.start.y);
    start.read("heading", &world.start.heading);
  });
  file.read("repeat", &world.repeat);
  file.read("duration", &world.duration);
  file.read_points("waypoints", &world.waypoints);
  file.read_prefixed("closure_", &world.closures);
  file.read_points("landmarks", &world.landmarks);
  file.read_section("robot", [&](YamlSection& robot) { read_robot(robot, &world); });
  file.read_section("odometry",
                    [&](YamlSection& section) { read_odometry(section, &world.odometry); });
  file.read_section("ranges", [&](YamlSection& section) { read_ranges(section, &world.ranges); });
  file.read_sections("beacons", [&](YamlSection& beacon) {
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
  YamlSection file = YamlSection::of_text(text, source);
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
