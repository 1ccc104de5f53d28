#include "pf_resampling_core/simulation/world.hpp"

#include <cmath>
#include <set>
#include <sstream>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

[[noreturn]] void fail(const std::string& name, double value, const std::string& allowed) {
  std::ostringstream text;
  text << name << " is " << value << ", allowed: " << allowed;
  throw Error(text.str());
}

void check_positive(const std::string& name, double value) {
  if (!(std::isfinite(value) && value > 0.0)) fail(name, value, "above 0");
}

void check_not_negative(const std::string& name, double value) {
  if (!(std::isfinite(value) && value >= 0.0)) fail(name, value, "0 or above");
}

void check_finite(const std::string& name, double value) {
  if (!std::isfinite(value)) fail(name, value, "a finite number");
}

void check_multiple(const std::string& name, double value, double period) {
  const double ratio = value / period;
  if (std::round(ratio) < 1.0 || std::abs(ratio - std::round(ratio)) > 1e-6) {
    std::ostringstream allowed;
    allowed << "a whole multiple of robot/control_period, " << period;
    fail(name, value, allowed.str());
  }
}

void check_drive(const World& world) {
  const DriveOptions& drive = world.drive;
  check_positive("robot/speed", drive.speed);
  check_positive("robot/speed_floor", drive.speed_floor);
  if (drive.speed_floor > 1.0) fail("robot/speed_floor", drive.speed_floor, "(0, 1]");
  check_positive("robot/yaw_rate_gain", drive.yaw_rate_gain);
  check_positive("robot/yaw_rate_limit", drive.yaw_rate_limit);
  check_positive("robot/reached_distance", drive.reached_distance);
  check_positive("robot/control_period", drive.control_period);
  check_finite("start/x", world.start.x);
  check_finite("start/y", world.start.y);
  check_finite("start/heading", world.start.heading);
  check_not_negative("duration", world.duration);
  if (world.waypoints.empty()) throw Error("the world has no waypoints: give at least one");
  if (world.repeat && world.duration <= 0.0) {
    throw Error("repeat is true and duration is 0: give the duration of the drive, in s");
  }
  for (const auto& [name, waypoint] : world.closures) {
    if (waypoint < 0 || waypoint >= static_cast<int>(world.waypoints.size())) {
      fail("closure_" + name, waypoint, "the number of a waypoint, counted from 0");
    }
  }
}

void check_odometry(const OdometryErrors& odometry, double control_period) {
  check_positive("odometry/period", odometry.period);
  check_multiple("odometry/period", odometry.period, control_period);
  check_not_negative("robot/motion_noise/speed", odometry.speed_sigma);
  check_not_negative("robot/motion_noise/lateral", odometry.lateral_sigma);
  check_not_negative("robot/motion_noise/yaw_rate", odometry.yaw_rate_sigma);
  check_positive("odometry/distance_scale", odometry.distance_scale);
  check_positive("odometry/yaw_scale", odometry.yaw_scale);
  check_finite("odometry/yaw_rate_bias", odometry.yaw_rate_bias);
  check_not_negative("odometry/yaw_rate_bias_drift", odometry.yaw_rate_bias_drift);
}

void check_ranges(const World& world) {
  const RangeSensorOptions& ranges = world.ranges;
  check_not_negative("ranges/rate", ranges.rate);
  check_not_negative("ranges/range_max", ranges.range_max);
  check_not_negative("ranges/outlier_share", ranges.outlier_share);
  check_not_negative("ranges/reflected_share", ranges.reflected_share);
  const double unusual = ranges.outlier_share + ranges.reflected_share;
  if (unusual > 1.0) fail("ranges/outlier_share + reflected_share", unusual, "[0, 1]");
  if (ranges.outlier_share > 0.0) check_positive("ranges/outlier_max", ranges.outlier_max);
  check_not_negative("ranges/reflected_excess_mean", ranges.reflected_excess_mean);
  if (ranges.rate > 0.0 && world.beacons.empty()) {
    throw Error("ranges/rate is given and the world has no beacons: give some, or rate 0");
  }
  std::set<int> ids;
  for (const SimulatedBeacon& beacon : world.beacons) {
    const std::string name = "beacon " + std::to_string(beacon.beacon.id);
    if (!ids.insert(beacon.beacon.id).second) throw Error(name + " is given twice");
    if (!beacon.beacon.position.allFinite())
      throw Error(name + " has a position that is not finite");
    check_positive(name + " scale", beacon.errors.scale);
    check_finite(name + " bias", beacon.errors.bias);
    check_not_negative(name + " sigma", beacon.errors.sigma);
  }
}

void check_landmark_sensor(const SimulatedLandmarkSensor& sensor) {
  check_not_negative("robot/observation_period", sensor.period);
  check_not_negative("robot/sensor/range_max", sensor.range_max);
  check_not_negative("robot/sensor/field_of_view", sensor.field_of_view);
  check_not_negative("robot/sensor/range_noise", sensor.range_sigma);
  check_not_negative("robot/sensor/bearing_noise", sensor.bearing_sigma);
}

// So that a drive ends, and fits into memory.
void check_amounts(const World& world) {
  const auto check_amount = [](const std::string& name, double amount) {
    if (!(amount <= 1e7))
      fail(name, amount, "1e7 at most; without duration a drive may take a day");
  };
  const double duration = world.duration > 0.0 ? world.duration : kLongestDrive;
  const SimulatedLandmarkSensor& sensor = world.landmark_sensor;
  check_amount("duration / robot/control_period", duration / world.drive.control_period);
  check_amount("odometry/period / robot/control_period",
               world.odometry.period / world.drive.control_period);
  check_amount("duration * ranges/rate", duration * world.ranges.rate);
  if (sensor.period > 0.0) {
    check_amount("duration / robot/observation_period", duration / sensor.period);
  }
}

}  // namespace

std::map<std::string, double*> numbers_of(World* world) {
  DriveOptions& drive = world->drive;
  OdometryErrors& odometry = world->odometry;
  SimulatedLandmarkSensor& sensor = world->landmark_sensor;
  RangeSensorOptions& ranges = world->ranges;
  return {{"area/x_min", &world->area.x_min},
          {"area/y_min", &world->area.y_min},
          {"area/x_max", &world->area.x_max},
          {"area/y_max", &world->area.y_max},
          {"start/x", &world->start.x},
          {"start/y", &world->start.y},
          {"start/heading", &world->start.heading},
          {"duration", &world->duration},
          {"robot/speed", &drive.speed},
          {"robot/speed_floor", &drive.speed_floor},
          {"robot/yaw_rate_gain", &drive.yaw_rate_gain},
          {"robot/yaw_rate_limit", &drive.yaw_rate_limit},
          {"robot/reached_distance", &drive.reached_distance},
          {"robot/control_period", &drive.control_period},
          {"robot/motion_noise/speed", &odometry.speed_sigma},
          {"robot/motion_noise/lateral", &odometry.lateral_sigma},
          {"robot/motion_noise/yaw_rate", &odometry.yaw_rate_sigma},
          {"robot/observation_period", &sensor.period},
          {"robot/sensor/range_max", &sensor.range_max},
          {"robot/sensor/field_of_view", &sensor.field_of_view},
          {"robot/sensor/range_noise", &sensor.range_sigma},
          {"robot/sensor/bearing_noise", &sensor.bearing_sigma},
          {"odometry/period", &odometry.period},
          {"odometry/distance_scale", &odometry.distance_scale},
          {"odometry/yaw_scale", &odometry.yaw_scale},
          {"odometry/yaw_rate_bias", &odometry.yaw_rate_bias},
          {"odometry/yaw_rate_bias_drift", &odometry.yaw_rate_bias_drift},
          {"ranges/rate", &ranges.rate},
          {"ranges/range_max", &ranges.range_max},
          {"ranges/outlier_share", &ranges.outlier_share},
          {"ranges/outlier_max", &ranges.outlier_max},
          {"ranges/reflected_share", &ranges.reflected_share},
          {"ranges/reflected_excess_mean", &ranges.reflected_excess_mean},
          {"ranges/antenna/x", &ranges.antenna.x()},
          {"ranges/antenna/y", &ranges.antenna.y()},
          {"ranges/antenna/z", &ranges.antenna.z()}};
}

void check_world(const World& world) {
  check_drive(world);
  check_odometry(world.odometry, world.drive.control_period);
  check_ranges(world);
  check_landmark_sensor(world.landmark_sensor);
  check_amounts(world);
}

}  // namespace pf_resampling
