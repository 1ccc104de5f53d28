// simulate_bag: a simulated drive as a bag, with the truth.
#include <cstdint>
#include <iostream>
#include <string>
#include <vector>

#include "tools/common/command_line.hpp"
#include "tools/datasets/recording_to_bag.hpp"
#include "tools/worlds/simulated_recording.hpp"
#include "tools/worlds/world_file.hpp"

namespace {

using namespace pf_resampling;
namespace po = boost::program_options;

/// One height for all beacons, or one for each.
void set_heights(const std::string& text, World* world) {
  const bool each = text.find(',') != std::string::npos;
  const std::vector<double> heights =
      parse_numbers("beacons-z", text, each ? world->beacons.size() : 1);
  for (std::size_t i = 0; i < world->beacons.size(); ++i) {
    world->beacons[i].beacon.position.z() = heights[each ? i : 0];
  }
}

/// The option's value, if it was given, in the place of the world's; what makes no sense there is
/// told by check_world().
void set_from(const CommandLine& line, const std::string& option, double* value) {
  if (line.has(option)) *value = line.get<double>(option);
}

int simulate_bag(const std::vector<std::string>& arguments) {
  std::string known;
  for (const std::string& name : builtin_worlds()) known += (known.empty() ? "" : ", ") + name;
  CommandLine line(
      "simulate_bag",
      "Simulates a drive and writes what the robot would have recorded as a bag, with\n"
      "the truth. The same world, seed and options give the same bytes.\n"
      "Worlds: " +
          known +
          ", or the path of\n"
          "a YAML file like those of config/worlds, or of a map of the public FastSLAM simulator\n"
          "(.mat with landmarks lm and way-points wp), driven by the robot of indoor_two_loops\n"
          "with a sensor that reaches 30 m.");
  line.positional("WORLD", "name of a world, or path of a world's YAML file or of a map");
  line.positional("out.bag", "the bag to write");
  line.options()("seed", po::value<std::int64_t>()->default_value(1)->value_name("N"),
                 "seed of the noise; the path driven does not depend on it")(
      "duration", po::value<double>()->value_name("S"),
      "length of the drive in seconds, instead of the world's")(
      "repeat", po::bool_switch(),
      "after the last way-point the first one again, until --duration is over")(
      "beacons-z", po::value<std::string>()->value_name("Z[,Z...]"),
      "height of all beacons, or of each, in metres, instead of the world's")(
      "speed", po::value<double>()->value_name("V"), "m/s, instead of the world's")(
      "sensor-range", po::value<double>()->value_name("R"),
      "how far landmarks are seen, in metres, instead of the world's")(
      "range-noise", po::value<double>()->value_name("SIGMA"),
      "of landmark observations, in metres, instead of the world's")(
      "bearing-noise", po::value<double>()->value_name("SIGMA"), "likewise, in radians")(
      "unknown-ids", po::bool_switch(), "landmark observations carry no ids (-1)");
  line.example("simulate_bag beacons_circle circle.bag --seed 1");
  line.example("simulate_bag beacons_figure8 high.bag --duration 300 --beacons-z 2.5");
  line.example("simulate_bag indoor_two_loops loops.bag --unknown-ids");
  line.example("simulate_bag indoor_two_loops hour.bag --repeat --duration 3600");
  line.example("simulate_bag my_world.yaml my_world.bag");
  line.example("simulate_bag example_webmap.mat webmap.bag --speed 2");
  if (!line.parse(arguments)) return 0;

  const auto seed = line.get<std::int64_t>("seed");
  if (seed < 0) throw UsageError("--seed " + std::to_string(seed) + ": has to be 0 or above");
  const std::string name = line.get<std::string>("WORLD");
  const std::string out = line.get<std::string>("out.bag");
  World world = load_world(name);
  if (line.has("duration")) {
    world.duration = line.get<double>("duration");
    if (!(world.duration > 0.0)) throw UsageError("--duration has to be above 0, in seconds");
  }
  if (line.get<bool>("repeat")) world.repeat = true;
  set_from(line, "speed", &world.drive.speed);
  set_from(line, "sensor-range", &world.landmark_sensor.range_max);
  set_from(line, "range-noise", &world.landmark_sensor.range_sigma);
  set_from(line, "bearing-noise", &world.landmark_sensor.bearing_sigma);
  if (line.has("beacons-z")) set_heights(line.get<std::string>("beacons-z"), &world);

  Recording recording = simulated_recording(world, static_cast<std::uint64_t>(seed));
  if (line.get<bool>("unknown-ids")) {
    for (auto& observation : recording.landmark_observations) observation.id = -1;
  }
  write_recording(recording, out);
  std::cout << name << "\n" << report(recording) << "wrote " << out << "\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return pf_resampling::run_tool("simulate_bag", argc, argv, simulate_bag);
}
