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

enum class Least { none, zero, more };  // that a number may be: anything, zero, or more than that

void check_number(const std::string& name, double value, Least least) {
  const bool is_fine = std::isfinite(value) && (least == Least::none || value > 0.0 ||
                                                (least == Least::zero && value == 0.0));
  const char* const allowed[] = {"a finite number", "0 or above", "above 0"};
  if (!is_fine) fail(name, value, allowed[static_cast<int>(least)]);
}

struct Number {
  const char* key;
  double* value;
  Least least;
};

std::vector<Number> table_of(World* world) {
  DriveOptions& drive = world->drive;
  OdometryErrors& odometry = world->odometry;
  SimulatedLandmarkSensor& sensor = world->landmark_sensor;
  RangeSensorOptions& ranges = world->ranges;
  return {{"start/x", &world->start.x, Least::none},
          {"start/y", &world->start.y, Least::none},
          {"start/heading", &world->start.heading, Least::none},
          {"duration", &world->duration, Least::zero},
          {"robot/speed", &drive.speed, Least::more},
          {"robot/speed_floor", &drive.speed_floor, Least::more},
          {"robot/yaw_rate_gain", &drive.yaw_rate_gain, Least::more},
          {"robot/yaw_rate_limit", &drive.yaw_rate_limit, Least::more},
          {"robot/reached_distance", &drive.reached_distance, Least::more},
          {"robot/control_period", &drive.control_period, Least::more},
          {"robot/motion_noise/speed", &odometry.speed_sigma, Least::zero},
          {"robot/motion_noise/lateral", &odometry.lateral_sigma, Least::zero},
          {"robot/motion_noise/yaw_rate", &odometry.yaw_rate_sigma, Least::zero},
          {"robot/observation_period", &sensor.period, Least::zero},
          {"robot/sensor/range_max", &sensor.range_max, Least::zero},
          {"robot/sensor/field_of_view", &sensor.field_of_view, Least::zero},
          {"robot/sensor/range_noise", &sensor.range_sigma, Least::zero},
          {"robot/sensor/bearing_noise", &sensor.bearing_sigma, Least::zero},
          {"odometry/period", &odometry.period, Least::more},
          {"odometry/distance_scale", &odometry.distance_scale, Least::more},
          {"odometry/yaw_scale", &odometry.yaw_scale, Least::more},
          {"odometry/yaw_rate_bias", &odometry.yaw_rate_bias, Least::none},
          {"odometry/yaw_rate_bias_drift", &odometry.yaw_rate_bias_drift, Least::zero},
          {"ranges/rate", &ranges.rate, Least::zero},
          {"ranges/range_max", &ranges.range_max, Least::zero},
          {"ranges/outlier_share", &ranges.outlier_share, Least::zero},
          {"ranges/outlier_max", &ranges.outlier_max, Least::zero},
          {"ranges/reflected_share", &ranges.reflected_share, Least::zero},
          {"ranges/reflected_excess_mean", &ranges.reflected_excess_mean, Least::zero},
          {"ranges/antenna/x", &ranges.antenna.x(), Least::none},
          {"ranges/antenna/y", &ranges.antenna.y(), Least::none},
          {"ranges/antenna/z", &ranges.antenna.z(), Least::none}};
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
  const double floor = world.drive.speed_floor;
  if (floor > 1.0) fail("robot/speed_floor", floor, "(0, 1]");
  check_multiple("odometry/period", world.odometry.period, world.drive.control_period);
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

void check_ranges(const World& world) {
  const RangeSensorOptions& ranges = world.ranges;
  const double unusual = ranges.outlier_share + ranges.reflected_share;
  if (unusual > 1.0) fail("ranges/outlier_share + reflected_share", unusual, "[0, 1]");
  if (ranges.outlier_share > 0.0)
    check_number("ranges/outlier_max", ranges.outlier_max, Least::more);
  if (ranges.rate > 0.0 && world.beacons.empty()) {
    throw Error("ranges/rate is given and the world has no beacons: give some, or rate 0");
  }
  std::set<int> ids;
  for (const SimulatedBeacon& beacon : world.beacons) {
    const std::string name = "beacon " + std::to_string(beacon.beacon.id);
    if (!ids.insert(beacon.beacon.id).second) throw Error(name + " is given twice");
    if (!beacon.beacon.position.allFinite())
      throw Error(name + " has a position that is not finite");
    check_number(name + " scale", beacon.errors.scale, Least::more);
    check_number(name + " bias", beacon.errors.bias, Least::none);
    check_number(name + " sigma", beacon.errors.sigma, Least::zero);
  }
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
  std::map<std::string, double*> numbers;
  for (const Number& number : table_of(world)) numbers[number.key] = number.value;
  return numbers;
}

void check_world(const World& world) {
  World copy = world;
  for (const Number& number : table_of(&copy)) {
    check_number(number.key, *number.value, number.least);
  }
  check_drive(world);
  check_ranges(world);
  check_amounts(world);
}

}  // namespace pf_resampling
