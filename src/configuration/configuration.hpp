#pragma once

#include <xmlrpcpp/XmlRpcValue.h>

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/models/beacon_range.hpp"

namespace pf_resampling {

/// What a configuration file, or the private parameters of a node, say. Nothing in it has been
/// checked against the parameters there are; set_parameters() of the core does that.
struct Configuration {
  /// "group/name" -> value as text; for the core's set_parameters().
  std::map<std::string, std::string> values;
  std::vector<Beacon> beacons;                  ///< `beacons`: id, x, y and, optionally, z
  std::map<std::string, int> beacon_frames;     ///< `frame` of a beacon -> its id
  std::map<int, RangeCalibration> calibration;  ///< `calibration` by id of beacon; -1: all others
  std::map<std::string, Eigen::Vector3d> antennas;  ///< `antennas`: frame -> place on the robot, m
  std::map<std::string, Pose2> sensors;  ///< `sensors`: frame -> pose on the robot, m and rad
};

/// Reads a YAML file: nested maps are groups of parameters, and the lists
///
///     beacons: [{id: 1, x: 0.0, y: 0.0, z: 0.0}]           # z may be left out; frame: its name
///     calibration: [{beacon: 1, scale: 1.07, bias: 0.01, sigma: 0.56}]  # beacon -1: all others
///     antennas: [{frame: antenna, x: 0.1, y: 0.0, z: 0.5}]
///     sensors: [{frame: laser, x: 0.2, y: 0.0, yaw: 0.0}]  # yaw may be left out
///
/// Throws Error naming file, line and what is wrong there.
Configuration read_configuration(const std::string& path);

/// The same from YAML text; `name` stands for the file in errors.
Configuration parse_configuration(const std::string& text, const std::string& name);

/// The same from a node's private parameters.
Configuration configuration_of(const XmlRpc::XmlRpcValue& parameters);

/// Without control characters: what yaml-cpp says of a file may have any.
std::string one_line(std::string text);

/// "group/name=value" -> a configuration with that value. Throws Error without '='.
Configuration parse_assignment(const std::string& text);

}  // namespace pf_resampling
