// simulate_bag: a simulated drive as a bag, with the truth.
#include <cstdint>
#include <iostream>
#include <string>
#include <vector>

#include "common/command_line.hpp"
#include "datasets/recording_to_bag.hpp"
#include "worlds/simulated_recording.hpp"
#include "worlds/world_file.hpp"

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

int simulate_bag(const std::vector<std::string>& arguments) {
  std::string known;
  for (const std::string& name : builtin_worlds()) known += (known.empty() ? "" : ", ") + name;
  CommandLine line(
      "simulate_bag",
      "Simulates a drive and writes what the robot would have recorded as a bag, with\n"
      "the truth. The same world, seed and options give the same bytes.\n"
      "Worlds: " +
          known +
          ", or the path of a YAML file like those of\n"
          "config/worlds.");
  line.positional("WORLD", "name of a world or path of a world's YAML file");
  line.positional("out.bag", "the bag to write");
  line.options()("seed", po::value<std::int64_t>()->default_value(1)->value_name("N"),
                 "seed of the noise; the path driven does not depend on it")(
      "duration", po::value<double>()->value_name("S"),
      "length of the drive in seconds, instead of the world's")(
      "beacons-z", po::value<std::string>()->value_name("Z[,Z...]"),
      "height of all beacons, or of each, in metres, instead of the world's");
  line.example("simulate_bag beacons_circle circle.bag --seed 1");
  line.example("simulate_bag beacons_figure8 high.bag --duration 300 --beacons-z 2.5");
  line.example("simulate_bag my_world.yaml my_world.bag");
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
  if (line.has("beacons-z")) set_heights(line.get<std::string>("beacons-z"), &world);

  const Recording recording = simulated_recording(world, static_cast<std::uint64_t>(seed));
  write_recording(recording, out);
  std::cout << name << "\n" << report(recording) << "wrote " << out << "\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return pf_resampling::run_tool("simulate_bag", argc, argv, simulate_bag);
}
