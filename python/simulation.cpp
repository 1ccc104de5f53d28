// Drives through simulated worlds.
#include <cmath>

#include "pf_resampling_core/simulation/simulate.hpp"
#include "python/bindings.hpp"

namespace pf_resampling {
namespace {

constexpr double kSameTime = 1e-6;  // s: multiples of periods are not exact

std::vector<SimulatedStep> steps_of(const World& world, const SimulatedDrive& drive,
                                    const OdometryNoise& noise) {
  std::vector<SimulatedStep> steps;
  std::size_t next = 1;
  for (const SimulatedDrive::Scan& scan : drive.scans) {
    SimulatedStep step;
    step.time = scan.time;
    for (; next < drive.odometry.size(); ++next) {
      const SimulatedDrive::Odometry& before = drive.odometry[next - 1];
      const SimulatedDrive::Odometry& now = drive.odometry[next];
      if (now.time > scan.time + kSameTime) break;
      append(noise, relative(before.pose, now.pose), now.time - before.time, &step.odometry);
    }
    const SimulatedDrive::Odometry& now = drive.odometry[next - 1];
    if (std::abs(now.time - scan.time) > kSameTime) {
      throw Error(
          "a scan falls between two odometry messages: the period of scans has to be a "
          "multiple of that of odometry");
    }
    step.truth = relative(world.start, now.truth);
    step.dead_reckoning = now.pose;
    for (const SimulatedLandmarkObservation& seen : scan.observations) {
      // Noise leaves nothing of the range to a landmark under the robot's feet: not to be used.
      if (seen.range > 0.0) step.seen.push_back({seen.id, seen.range, seen.bearing});
    }
    steps.push_back(step);
  }
  return steps;
}

}  // namespace

void add_simulation(py::module* module) {
  py::class_<SimulatedStep>(*module, "SimulatedStep",
                            "A scan of a simulated drive among landmarks; poses from the start.")
      .def_readonly("time", &SimulatedStep::time)
      .def_property_readonly("truth",
                             [](const SimulatedStep& self) { return array_of(self.truth); })
      .def_property_readonly(
          "dead_reckoning", [](const SimulatedStep& self) { return array_of(self.dead_reckoning); })
      .def_property_readonly(
          "motion", [](const SimulatedStep& self) { return array_of(self.odometry.mean); },
          "By the odometry since the step before.")
      .def_property_readonly("motion_covariance",
                             [](const SimulatedStep& self) { return self.odometry.covariance; })
      .def_property_readonly(
          "seen",
          [](const SimulatedStep& self) {
            std::vector<std::tuple<int, double, double>> seen;
            for (const auto& each : self.seen) seen.emplace_back(each.id, each.range, each.bearing);
            return seen;
          },
          "[(id, range, bearing)]; ids are places in the list of the landmarks.");
  module->def(
      "simulate",
      [](const std::map<std::string, double>& numbers,
         const std::vector<Eigen::Vector2d>& waypoints,
         const std::vector<Eigen::Vector2d>& landmarks, const std::map<std::string, int>& closures,
         bool repeat, std::uint64_t seed, const py::dict& odometry) {
        World world;
        const auto known = numbers_of(&world);
        for (const auto& [name, value] : numbers) {
          if (known.count(name) == 0) throw Error(name + " is no number of a world");
          *known.at(name) = value;
        }
        world.waypoints = waypoints;
        world.landmarks = landmarks;
        world.closures = closures;
        world.repeat = repeat;
        OdometryNoise noise;
        ParameterList parameters;
        add_parameters(&noise, &parameters);
        set_from(odometry, "odometry/", parameters);
        const SimulatedDrive drive = simulate(world, seed);
        return py::make_tuple(steps_of(world, drive, noise), drive.closures);
      },
      "numbers"_a, "waypoints"_a, "landmarks"_a, "closures"_a, "repeat"_a, "seed"_a, "odometry"_a,
      "A drive through a world, whose keys are those of config/worlds: its steps, and when each "
      "closure's way-point was reached (s). `odometry`: its noise as the filter is told, by the "
      "parameters below odometry/.");
}

}  // namespace pf_resampling
