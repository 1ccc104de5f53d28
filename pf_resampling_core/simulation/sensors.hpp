#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/simulation/driving.hpp"
#include "pf_resampling_core/simulation/world.hpp"

namespace pf_resampling {

/// Dead reckoning with its errors: integrates what encoders and gyro would say about each control.
class SimulatedOdometry {
 public:
  SimulatedOdometry(const OdometryErrors& errors, double control_period, std::uint64_t seed);

  /// One control period later. Periods have to be told in order, from `step` 0.
  void advance(const Control& truth, std::uint32_t step);

  /// Pose integrated since the start, which is the origin.
  const Pose2& pose() const { return pose_; }
  /// What was measured during the last control period.
  const Control& measured() const { return measured_; }

 private:
  OdometryErrors errors_;
  double control_period_;
  std::uint64_t seed_;
  double yaw_rate_bias_;
  Pose2 pose_;
  Control measured_;
};

/// The range that the radio reports from `pose`, number `observation` of the drive. Nothing when
/// the beacon is out of reach.
std::optional<double> measure_range(const RangeSensorOptions& options,
                                    const SimulatedBeacon& beacon, const Pose2& pose,
                                    std::uint64_t seed, std::uint32_t observation);

/// One landmark as the sensor sees it.
struct SimulatedLandmarkObservation {
  int id = 0;            ///< position in the world's list
  double range = 0.0;    ///< m
  double bearing = 0.0;  ///< rad, counter-clockwise from ahead
};

/// The landmarks within reach and field of view of `pose`, in order of id, in scan number `scan`.
std::vector<SimulatedLandmarkObservation> observe_landmarks(
    const SimulatedLandmarkSensor& options, const std::vector<Eigen::Vector2d>& landmarks,
    const Pose2& pose, std::uint64_t seed, std::uint32_t scan);

}  // namespace pf_resampling
