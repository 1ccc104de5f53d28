#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {

/// What a simulated robot recorded on a drive; write_recording() makes a bag of it. Times in
/// seconds, on one clock; each list in order of time.
struct Recording {
  /// Dead reckoning: where the robot would be had it started at the origin and slipped nowhere.
  struct Odometry {
    double time = 0.0;
    Pose2 pose;  ///< frame "odom"
    /// Variances of the mean velocities since the pose before, ahead and to the left (m^2/s^2) and
    /// about the vertical (rad^2/s^2); zero: unknown.
    std::array<double, 3> twist_variances = {};
  };
  /// A distance measured between an antenna and a beacon, as the radio gave it, but in metres.
  struct Range {
    double time = 0.0;
    std::int32_t beacon = 0;
    double range = 0.0;             ///< m
    double variance = 0.0;          ///< m^2; 0: unknown
    std::string frame = "antenna";  ///< of the antenna
  };
  struct Beacon {
    std::int32_t id = 0;
    double x = 0.0;           ///< m, frame "map"
    double y = 0.0;           ///< m
    std::optional<double> z;  ///< m; without: as high as the antenna
  };
  /// One landmark seen in a scan; observations of equal time are one scan. Frame "sensor".
  struct LandmarkObservation {
    double time = 0.0;
    std::int32_t id = -1;           ///< -1: unknown
    double range = 0.0;             ///< m
    double bearing = 0.0;           ///< rad, counter-clockwise from the sensor's x axis
    double range_variance = 0.0;    ///< m^2; 0: unknown
    double bearing_variance = 0.0;  ///< rad^2; 0: unknown
  };
  struct Landmark {
    std::int32_t id = 0;
    double x = 0.0;  ///< m, frame "map"
    double y = 0.0;  ///< m
  };
  struct Truth {
    double time = 0.0;
    Pose2 pose;  ///< frame "map"
  };
  /// Where something sits on the robot: a frame below "base_link".
  struct Frame {
    std::string name;
    double x = 0.0;    ///< m
    double y = 0.0;    ///< m
    double z = 0.0;    ///< m
    double yaw = 0.0;  ///< rad
  };

  std::vector<Odometry> odometry;
  std::vector<Range> ranges;
  std::vector<Beacon> beacons;
  std::vector<LandmarkObservation> landmark_observations;
  std::vector<Landmark> landmarks;
  std::vector<Truth> truth;
  std::vector<Frame> frames;

  /// What is worth knowing of it, a line each, for people.
  std::vector<std::string> notes;
};

/// The recording's counts, duration and rates, a line each, then its notes.
std::string report(const Recording& recording);

}  // namespace pf_resampling
