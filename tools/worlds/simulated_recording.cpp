#include "tools/worlds/simulated_recording.hpp"

#include <cmath>

#include "pf_resampling_core/simulation/simulate.hpp"

namespace pf_resampling {
namespace {

void add_landmarks(const World& world, const SimulatedDrive& drive, Recording* recording) {
  for (std::size_t id = 0; id < world.landmarks.size(); ++id) {
    recording->landmarks.push_back({static_cast<std::int32_t>(id), world.landmarks[id]});
  }
  const SimulatedLandmarkSensor& sensor = world.landmark_sensor;
  for (const auto& scan : drive.scans) {
    recording->scans.push_back({scan.time, "sensor", {}});
    for (const auto& seen : scan.observations) {
      recording->scans.back().landmarks.push_back({seen.id, seen.range, seen.bearing,
                                                   sensor.range_sigma * sensor.range_sigma,
                                                   sensor.bearing_sigma * sensor.bearing_sigma});
    }
  }
  if (sensor.period > 0.0) recording->frames["sensor"] = Eigen::Isometry3d::Identity();
}

void add_beacons(const World& world, const SimulatedDrive& drive, Recording* recording) {
  for (const SimulatedBeacon& beacon : world.beacons) recording->beacons.push_back(beacon.beacon);
  for (const auto& range : drive.ranges) {
    recording->ranges.push_back({range.time, "antenna", range.beacon, range.range});
  }
  if (world.ranges.rate > 0.0) {
    recording->frames["antenna"] = Eigen::Translation3d(world.ranges.antenna);
  }
}

}  // namespace

Recording simulated_recording(const World& world, std::uint64_t seed) {
  const SimulatedDrive drive = simulate(world, seed);
  Recording recording;
  // White for each control.
  const OdometryErrors& errors = world.odometry;
  const double root = std::sqrt(world.drive.control_period);
  recording.odometry_noise = {root * errors.speed_sigma, root * errors.lateral_sigma,
                              root * errors.yaw_rate_sigma};
  for (const auto& odometry : drive.odometry) {
    recording.odometry.push_back({odometry.time, odometry.pose});
    recording.truth.push_back({odometry.time, odometry.truth});
  }
  add_beacons(world, drive, &recording);
  add_landmarks(world, drive, &recording);
  return recording;
}

}  // namespace pf_resampling
