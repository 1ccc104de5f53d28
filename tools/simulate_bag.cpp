// simulate_bag: a simulated drive as a bag, with the truth.
#include <boost/algorithm/string/join.hpp>
#include <cstdint>
#include <iostream>
#include <string>
#include <vector>

#include "tools/common/command_line.hpp"
#include "tools/worlds/simulated_bag.hpp"
#include "tools/worlds/world_file.hpp"

namespace {

using namespace pf_resampling;

CommandLine command_line() {
  CommandLine line(
      "simulate_bag",
      "Simulates a drive and writes the bag that the robot would have recorded, with the\nground "
      "truth. The same world, seed and options give the same bytes.\nWorlds: " +
          boost::algorithm::join(builtin_worlds(), ", ") +
          ", or the path of\na YAML file like those in config/worlds.");
  line.positional("WORLD", "name of a world, or path of a world's YAML file");
  line.positional("out.bag", "the bag to write");
  line.reads("WORLD");
  line.writes("out.bag");
  line.option<std::int64_t>("seed", "N", 1, "seed of the noise; the path does not depend on it");
  line.option<double>("duration", "S",
                      "length of the drive in seconds, instead of that of the world");
  line.flag("repeat", "repeat the waypoints until --duration is over");
  line.flag("unknown-ids", "landmark observations carry no ids (-1)");
  line.example("simulate_bag beacons_circle circle.bag --seed 1");
  line.example("simulate_bag indoor_two_loops loops.bag --unknown-ids");
  line.example("simulate_bag indoor_two_loops hour.bag --repeat --duration 3600");
  line.example("simulate_bag my_world.yaml my_world.bag");
  return line;
}

/// The world of the command line, with what its options change.
World world_from(const CommandLine& line) {
  World world = load_world(line.text("WORLD"));
  if (line.has("duration")) world.duration = line.get<double>("duration");
  if (line.has("duration") && !(world.duration > 0.0)) {
    throw UsageError("--duration has to be above 0, in seconds");
  }
  if (line.get<bool>("repeat")) world.repeat = true;
  return world;
}

int simulate_bag(const std::vector<std::string>& arguments) {
  CommandLine line = command_line();
  if (!line.parse(arguments)) return 0;
  const auto seed = line.get<std::int64_t>("seed");
  if (seed < 0) throw UsageError("--seed " + std::to_string(seed) + ": has to be 0 or above");
  write_simulated_bag(world_from(line), static_cast<std::uint64_t>(seed),
                      !line.get<bool>("unknown-ids"), line.text("out.bag"));
  std::cout << "wrote " << line.text("out.bag") << "\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return pf_resampling::run_tool("simulate_bag", argc, argv, simulate_bag);
}
