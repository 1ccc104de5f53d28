// simulate_bag: a simulated drive as a bag, with the truth.
#include <cstdint>
#include <string>
#include <vector>

#include "tools/common/command_line.hpp"
#include "tools/common/table.hpp"
#include "tools/worlds/recording_to_bag.hpp"
#include "tools/worlds/simulated_recording.hpp"
#include "tools/worlds/world_file.hpp"

namespace {

using namespace pf_resampling;

/// One height for all beacons, or one for each.
void set_heights(const std::string& text, World* world) {
  const bool each = text.find(',') != std::string::npos;
  const std::vector<double> heights =
      parse_numbers("beacons-z", text, each ? world->beacons.size() : 1);
  for (std::size_t i = 0; i < world->beacons.size(); ++i) {
    world->beacons[i].beacon.position.z() = heights[each ? i : 0];
  }
}

/// Replaces the world's value by that of the option, if it was given; check_world() rejects what
/// makes no sense.
void set_from(const CommandLine& line, const std::string& option, double* value) {
  if (line.has(option)) *value = line.get<double>(option);
}

CommandLine command_line() {
  CommandLine line(
      "simulate_bag",
      "Simulates a drive and writes the bag that the robot would have recorded, with the\nground "
      "truth. The same world, seed and options give the same bytes.\nWorlds: " +
          joined(builtin_worlds(), ", ") +
          ", or the path of\na YAML file like those in config/worlds.");
  line.positional("WORLD", "name of a world, or path of a world's YAML file");
  line.positional("out.bag", "the bag to write");
  line.reads("WORLD");
  line.writes("out.bag");
  line.option<std::int64_t>("seed", "N", 1, "seed of the noise; the path does not depend on it");
  line.option<double>("duration", "S",
                      "length of the drive in seconds, instead of that of the world");
  line.flag("repeat", "repeat the waypoints until --duration is over");
  line.option<std::string>(
      "beacons-z", "Z[,Z...]",
      "height of all beacons, or of each, in metres, instead of those of the world");
  line.option<double>("speed", "V", "speed in m/s, instead of that of the world");
  line.option<double>("sensor-range", "R",
                      "range of the landmark sensor in metres, instead of that of the world");
  line.option<double>(
      "range-noise", "SIGMA",
      "standard deviation of the range of landmarks, in metres, instead of that of the world");
  line.option<double>(
      "bearing-noise", "SIGMA",
      "standard deviation of the bearing of landmarks, in radians, instead of that of the world");
  line.flag("unknown-ids", "landmark observations carry no ids (-1)");
  line.example("simulate_bag beacons_circle circle.bag --seed 1");
  line.example("simulate_bag beacons_figure8 high.bag --duration 300 --beacons-z 2.5");
  line.example("simulate_bag indoor_two_loops loops.bag --unknown-ids");
  line.example("simulate_bag indoor_two_loops hour.bag --repeat --duration 3600");
  line.example("simulate_bag my_world.yaml my_world.bag");
  return line;
}

/// The world of the command line, with what its options change.
World world_from(const CommandLine& line) {
  World world = load_world(line.text("WORLD"));
  set_from(line, "duration", &world.duration);
  if (line.has("duration") && !(world.duration > 0.0)) {
    throw UsageError("--duration has to be above 0, in seconds");
  }
  if (line.get<bool>("repeat")) world.repeat = true;
  set_from(line, "speed", &world.drive.speed);
  set_from(line, "sensor-range", &world.landmark_sensor.range_max);
  set_from(line, "range-noise", &world.landmark_sensor.range_sigma);
  set_from(line, "bearing-noise", &world.landmark_sensor.bearing_sigma);
  if (line.has("beacons-z")) set_heights(line.text("beacons-z"), &world);
  return world;
}

int simulate_bag(const std::vector<std::string>& arguments) {
  CommandLine line = command_line();
  if (!line.parse(arguments)) return 0;
  const auto seed = line.get<std::int64_t>("seed");
  if (seed < 0) throw UsageError("--seed " + std::to_string(seed) + ": has to be 0 or above");
  Recording recording = simulated_recording(world_from(line), static_cast<std::uint64_t>(seed));
  if (line.get<bool>("unknown-ids")) {
    for (StampedScan& scan : recording.scans) {
      for (SeenLandmark& seen : scan.landmarks) seen.id = -1;
    }
  }
  write_and_report(recording, line.text("WORLD"), line.text("out.bag"));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return pf_resampling::run_tool("simulate_bag", argc, argv, simulate_bag);
}
