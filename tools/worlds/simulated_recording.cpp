#include "tools/worlds/simulated_recording.hpp"

#include <array>

#include "pf_resampling_core/simulation/simulate.hpp"
#include "tools/common/table.hpp"

namespace pf_resampling {
namespace {

void add_landmarks(const World& world, const SimulatedDrive& drive, Recording* recording) {
  for (std::size_t id = 0; id < world.landmarks.size(); ++id) {
    const Eigen::Vector2d& position = world.landmarks[id];
    recording->landmarks.push_back({static_cast<std::int32_t>(id), position.x(), position.y()});
  }
  const SimulatedLandmarkSensor& sensor = world.landmark_sensor;
  for (const auto& scan : drive.scans) {
    for (const auto& seen : scan.observations) {
      recording->landmark_observations.push_back({scan.time, seen.id, seen.range, seen.bearing,
                                                  sensor.range_sigma * sensor.range_sigma,
                                                  sensor.bearing_sigma * sensor.bearing_sigma});
    }
  }
  if (sensor.period > 0.0) recording->frames.push_back({"sensor", 0.0, 0.0, 0.0, 0.0});
}

void add_beacons(const World& world, const SimulatedDrive& drive, Recording* recording) {
  for (const SimulatedBeacon& simulated : world.beacons) {
    const Beacon& beacon = simulated.beacon;
    recording->beacons.push_back(
        {beacon.id, beacon.position.x(), beacon.position.y(), beacon.position.z()});
  }
  for (const auto& range : drive.ranges) {
    recording->ranges.push_back({range.time, range.beacon, range.range, 0.0, "antenna"});
  }
  const Eigen::Vector3d& antenna = world.ranges.antenna;
  if (world.ranges.rate > 0.0) {
    recording->frames.push_back({"antenna", antenna.x(), antenna.y(), antenna.z(), 0.0});
  }
}

}  // namespace

Recording simulated_recording(const World& world, std::uint64_t seed) {
  const SimulatedDrive drive = simulate(world, seed);
  Recording recording;
  // White for each control: the mean over a message's controls has the variance of one by their
  // number.
  const OdometryErrors& errors = world.odometry;
  const double share = world.drive.control_period / errors.period;
  const std::array<double, 3> variances = {share * errors.speed_sigma * errors.speed_sigma,
                                           share * errors.lateral_sigma * errors.lateral_sigma,
                                           share * errors.yaw_rate_sigma * errors.yaw_rate_sigma};
  for (const auto& odometry : drive.odometry) {
    recording.odometry.push_back({odometry.time, odometry.pose, variances});
    recording.truth.push_back({odometry.time, odometry.truth});
  }
  add_beacons(world, drive, &recording);
  add_landmarks(world, drive, &recording);
  recording.notes.push_back("simulated, seed " + std::to_string(seed));
  for (const auto& [name, time] : drive.closures) {
    recording.notes.push_back("loop " + name + " closed after " + fixed(time, 1) + " s");
  }
  return recording;
}

}  // namespace pf_resampling
