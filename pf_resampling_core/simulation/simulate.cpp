#include "pf_resampling_core/simulation/simulate.hpp"

#include <cmath>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

// Appends the observations whose time has come by the end of a control period. Both sensors number
// their observations from 1, at whole multiples of their period.
class Observer {
 public:
  Observer(const World& world, std::uint64_t seed) : world_(world), seed_(seed) {}

  void observe(double begin, double end, const Pose2& pose, const Control& control,
               SimulatedDrive* drive) {
    const auto pose_at = [&](double time) {
      return compose(pose, arc_motion(control.speed, 0.0, control.yaw_rate, time - begin));
    };
    while (world_.ranges.rate > 0.0 && next_range() <= end + kTolerance) {
      const std::size_t which = (range_ - 1) % world_.beacons.size();
      const SimulatedBeacon& beacon = world_.beacons[which];
      const auto range = measure_range(world_.ranges, beacon, pose_at(next_range()), seed_, range_);
      if (range) drive->ranges.push_back({next_range(), beacon.beacon.id, *range});
      ++range_;
    }
    while (world_.landmark_sensor.period > 0.0 && next_scan() <= end + kTolerance) {
      drive->scans.push_back(
          {next_scan(), observe_landmarks(world_.landmark_sensor, world_.landmarks,
                                          pose_at(next_scan()), seed_, scan_)});
      ++scan_;
    }
  }

 private:
  static constexpr double kTolerance = 1e-9;  // s: multiples of periods are not exact

  double next_range() const { return range_ / world_.ranges.rate; }
  double next_scan() const { return scan_ * world_.landmark_sensor.period; }

  const World& world_;
  std::uint64_t seed_;
  std::uint32_t range_ = 1;
  std::uint32_t scan_ = 1;
};

}  // namespace

SimulatedDrive simulate(const World& world, std::uint64_t seed) {
  check_world(world);
  const double period = world.drive.control_period;
  const double duration = world.duration > 0.0 ? world.duration : kLongestDrive;
  const auto steps = static_cast<std::uint32_t>(std::lround(duration / period));
  const auto steps_per_message =
      static_cast<std::uint32_t>(std::lround(world.odometry.period / period));

  SimulatedDrive drive;
  Driver driver(world);
  SimulatedOdometry odometry(world.odometry, period, seed);
  Observer observer(world, seed);
  Pose2 pose = world.start;
  drive.odometry.push_back({0.0, pose, odometry.pose(), {}});

  for (std::uint32_t step = 0; step < steps; ++step) {
    const double begin = step * period;
    const double end = (step + 1) * period;
    const Control control = driver.next_control(pose);
    if (driver.finished()) break;
    for (const auto& [name, waypoint] : world.closures) {
      if (driver.target() == waypoint) drive.closures.emplace(name, begin);
    }
    observer.observe(begin, end, pose, control, &drive);
    pose = compose(pose, arc_motion(control.speed, 0.0, control.yaw_rate, period));
    odometry.advance(control, step);
    if ((step + 1) % steps_per_message == 0) {
      drive.odometry.push_back({end, pose, odometry.pose(), odometry.measured()});
    }
  }
  if (world.duration <= 0.0 && !driver.finished()) {
    throw Error(
        "the robot does not reach the last waypoint within a day, because it circles around a "
        "waypoint; raise robot/reached_distance or robot/yaw_rate_gain, or give a duration");
  }
  return drive;
}

}  // namespace pf_resampling
