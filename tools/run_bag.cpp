// Runs a filter over a bag, in-process and as fast as it goes: the code of the node without ROS
// around it. Same bag, seed and configuration: same bytes, at any number of threads.
#include "tools/common/command_line.hpp"
#include "tools/common/filter_options.hpp"
#include "tools/runs/filter_over_bag.hpp"

namespace pf_resampling {
namespace {

CommandLine command_line() {
  CommandLine line("run_bag", "Runs a filter over a bag. The output bag holds inputs and outputs.");
  line.positional("filter", "beacon_mcl or fastslam");
  line.positional("in.bag",
                  "bag to read: odometry, and either ranges and beacons (or beacons in --config), "
                  "or landmark observations",
                  false);
  line.positional("out.bag", "bag to write", false);
  add_filter_options(&line);
  line.topic("odom", "/odom", "odometry");
  line.topic("imu", "/imu", "IMU, for odometry_input/imu_heading");
  line.topic("ranges", "/ranges", "ranges");
  line.topic("sensor-ranges", "/sensor_ranges", "ranges as sensor_msgs/Range");
  line.topic("beacons", "/beacons", "beacons");
  line.topic("landmarks", "/landmarks", "landmark observations");
  line.option<std::string>("seed", "N", "seed of the random numbers (1)");
  line.option<std::string>("threads", "N",
                           "beacon_mcl: number of threads (1); the result does not depend on it");
  line.repeatable_option("more", "FILE",
                         "another bag of the same drive, such as the next part of a split "
                         "recording; may be repeated");
  line.option<double>("start", "S", "skip this many seconds at the start of the bag");
  line.option<double>("duration", "S", "stop after this many seconds");
  line.repeatable_option("topics", "TOPIC", "read only this topic; may be repeated");
  line.option<std::string>("tum", "FILE",
                           "write the path at the end, as text for evo: a line `time x y z qx qy "
                           "qz qw` for each pose");
  line.option<std::string>("map-csv", "FILE",
                           "fastslam: write the map at the end, as a table id,x,y,sigma");
  line.option<std::string>(
      "findings", "FILE",
      "write what has changed, or is wrong, as JSON: a list of kind, id, times, "
      "place, size and probability");
  line.flag("no-clouds",
            "leave out what is only for display: clouds, markers, and all paths but the last");
  line.flag("pose-only", "write pose and tf only");
  line.flag("dry-run", "write nothing; say what the filter would use, as JSON (for check_bag)");
  line.option<std::string>(
      "load-map", "FILE",
      "fastslam: continue a saved map; with --set map/frozen=true localize in it");
  line.option<std::string>("save-map", "FILE", "fastslam: save the map at the end");
  line.option<std::string>(
      "resume", "FILE",
      "continue from a checkpoint, with the configuration of the run that wrote it");
  line.option<std::string>("save-checkpoint", "FILE", "write a checkpoint at the end");
  for (const char* name : {"in.bag", "more", "load-map", "resume"}) line.reads(name);
  for (const char* name : {"out.bag", "save-map", "save-checkpoint", "tum", "map-csv", "findings"})
    line.writes(name);
  line.option_with_implicit(
      "parameters", "FORMAT", "yaml",
      "print all parameters, with the values that the other options set, and "
      "stop: as YAML, with =template as YAML in comments, with =markdown as a "
      "table");
  line.example("run_bag beacon_mcl plaza2.bag out.bag --seed 1 --threads 2");
  line.example("run_bag beacon_mcl plaza2.bag out.bag --config calibration.yaml --pose-only");
  line.example("run_bag fastslam mrclam.bag out.bag --save-map lab.map");
  line.example("run_bag beacon_mcl monday.bag m.bag --save-checkpoint monday.checkpoint");
  line.example("run_bag fastslam mrclam.bag out.bag --set preset=fast");
  line.example("run_bag fastslam part_0.bag out.bag --more part_1.bag --tum path.tum");
  line.example("run_bag fastslam --parameters=template > my.yaml");
  return line;
}

int run(const std::vector<std::string>& arguments) {
  CommandLine line = command_line();
  if (!line.parse(arguments)) return 0;
  const auto filter = line.text("filter");
  const bool is_fastslam = filter == "fastslam";
  if (!is_fastslam && filter != "beacon_mcl") {
    throw Error("filter '" + filter + "' is unknown; known are beacon_mcl and fastslam");
  }
  for (const char* option : {"load-map", "save-map", "map-csv"}) {
    if (line.has(option) && !is_fastslam) {
      throw UsageError(std::string("--") + option +
                       " is only for fastslam, because beacon_mcl has no map");
    }
  }
  if (line.has("parameters")) {
    is_fastslam ? print_fastslam_parameters(line) : print_beacon_mcl_parameters(line);
    return 0;
  }
  return is_fastslam ? fastslam_over_bag(line) : beacon_mcl_over_bag(line);
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  return pf_resampling::run_tool("run_bag", argc, argv, pf_resampling::run);
}
