// FastSLAM without ROS: simulates a drive through a room of landmarks and prints the map.
#include <cmath>
#include <cstdio>

#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "pf_resampling_core/simulation/simulate.hpp"

using namespace pf_resampling;

World room() {
  World world;
  world.waypoints = {{8.0, 0.0}, {8.0, 8.0}, {0.0, 8.0}, {0.0, 0.0}};
  world.repeat = true;
  world.duration = 120.0;
  for (int k = 0; k < 12; ++k) {
    const double angle = 2.0 * kPi * k / 12.0;
    world.landmarks.emplace_back(4.0 + 6.0 * std::cos(angle), 4.0 + 6.0 * std::sin(angle));
  }
  world.odometry.speed_sigma = 0.1;
  world.odometry.yaw_rate_sigma = 0.1;
  world.landmark_sensor = {0.5, 8.0, kPi, 0.1, 0.03};  // period, reach, view; sigmas: m, rad
  return world;
}

int main() {
  const World world = room();
  const SimulatedDrive drive = simulate(world, 1);

  FastSlamOptions options;
  options.strategy.resampling.scheme = ResamplingScheme::stratified;
  FastSlam filter(options, 1);

  std::size_t next = 1;
  for (const SimulatedDrive::Scan& scan : drive.scans) {
    OdometryIncrement odometry;
    for (; next < drive.odometry.size() && drive.odometry[next].time <= scan.time; ++next) {
      const SimulatedDrive::Odometry& before = drive.odometry[next - 1];
      const SimulatedDrive::Odometry& now = drive.odometry[next];
      append(options.odometry, relative(before.pose, now.pose), now.time - before.time, &odometry);
    }
    std::vector<RangeBearingObservation> observations;
    for (const SimulatedLandmarkObservation& seen : scan.observations) {
      observations.push_back({seen.id, seen.range, seen.bearing});
    }
    filter.update(odometry, observations);
  }

  std::printf("landmark      x (m)      y (m)  off by (m)\n");
  for (const LandmarkEstimate& landmark : filter.map()) {
    const Eigen::Vector2d truth = world.landmarks[static_cast<std::size_t>(landmark.id)];
    std::printf("%8d %10.2f %10.2f %11.2f\n", static_cast<int>(landmark.id), landmark.mean.x(),
                landmark.mean.y(), (landmark.mean - truth).norm());
  }
}
