#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/models/beacon_range.hpp"

namespace pf_resampling {

/// How the simulated robot drives from way-point to way-point.
struct DriveOptions {
  double speed = 1.0;             ///< m/s, slowed by the cosine of the heading error
  double speed_floor = 0.3;       ///< share of the speed that is kept however large that error
  double yaw_rate_gain = 2.0;     ///< 1/s: yaw rate = gain * heading error
  double yaw_rate_limit = 2.09;   ///< rad/s
  double reached_distance = 1.6;  ///< m: so close to a way-point, the next one becomes the target
  double control_period = 0.1;    ///< s
};

/// Errors of dead reckoning from wheel encoders and a gyro. The robot drives as it is told; what
/// its odometry says about that is wrong. White noise is drawn anew for every control period.
struct OdometryErrors {
  double period = 0.1;               ///< s between messages, a whole number of control periods
  double speed_sigma = 0.0;          ///< m/s, white
  double lateral_sigma = 0.0;        ///< m/s, white: sideways, as wheels see it that slip
  double yaw_rate_sigma = 0.0;       ///< rad/s, white
  double distance_scale = 1.0;       ///< measured distance / true distance
  double yaw_scale = 1.0;            ///< measured angle / true angle
  double yaw_rate_bias = 0.0;        ///< rad/s, at the start
  double yaw_rate_bias_drift = 0.0;  ///< rad/s per sqrt(s): random walk of the bias
};

/// A beacon with the systematic errors of its radio: range = scale * distance + bias + noise.
struct SimulatedBeacon {
  Beacon beacon;
  RangeCalibration errors;  ///< sigma is the noise itself here: 0 means none
};

/// The beacon radio: asks one beacon after the other.
struct RangeSensorOptions {
  double rate = 0.0;                   ///< ranges of all beacons together, 1/s; 0: no radio
  double range_max = 0.0;              ///< m: a beacon farther away does not answer; 0: no limit
  double outlier_share = 0.0;          ///< of the ranges: uniform between 0 and outlier_max
  double outlier_max = 0.0;            ///< m
  double reflected_share = 0.0;        ///< of the ranges: non-line-of-sight, too long
  double reflected_excess_mean = 0.0;  ///< m, mean of the exponential excess of those
  Eigen::Vector3d antenna = Eigen::Vector3d::Zero();  ///< m, where it sits on the robot
};

/// A sensor that sees landmarks by range and bearing, at the robot's origin.
struct SimulatedLandmarkSensor {
  double period = 0.0;         ///< s between scans; 0: no such sensor
  double range_max = 0.0;      ///< m
  double field_of_view = kPi;  ///< rad, the whole opening angle, centred ahead
  double range_sigma = 0.0;    ///< m
  double bearing_sigma = 0.0;  ///< rad
};

/// Everything a simulated drive is made of. SI units and radians, map frame.
struct World {
  Pose2 start;
  std::vector<Eigen::Vector2d> waypoints;
  bool repeat = false;    ///< after the last way-point the first one again, until `duration`
  double duration = 0.0;  ///< s; 0: until the last way-point is reached
  std::map<std::string, int> closures;     ///< name, way-point (from 0) whose turn marks it
  std::vector<Eigen::Vector2d> landmarks;  ///< id is the position in this list
  std::vector<SimulatedBeacon> beacons;
  DriveOptions drive;
  OdometryErrors odometry;
  RangeSensorOptions ranges;
  SimulatedLandmarkSensor landmark_sensor;
};

/// s: a drive without a duration of its own ends here at the latest.
constexpr double kLongestDrive = 86400.0;

/// Its numbers, by the keys of a world's file: "robot/sensor/range_max". Those of beacons are
/// theirs.
std::map<std::string, double*> numbers_of(World* world);

/// Throws Error naming the first value that makes no sense, with its allowed range. A drive has
/// 1e7 control periods, ranges and scans at most.
void check_world(const World& world);

}  // namespace pf_resampling
