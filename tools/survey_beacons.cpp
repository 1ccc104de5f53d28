// Finds where beacons are, and the errors of radios, wheels and antenna, by a drive among them.
#include <cmath>
#include <cstdio>
#include <string>

#include "beacon_mcl_node/beacon_file.hpp"
#include "beacon_mcl_node/pipeline_options.hpp"
#include "pf_resampling_core/range_memory/radio_remark.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/bag_contents.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/files.hpp"
#include "tools/common/filter_options.hpp"
#include "tools/common/plot_paths.hpp"
#include "tools/common/range_drive.hpp"

namespace pf_resampling {
namespace {

CommandLine command_line() {
  CommandLine line("survey_beacons",
                   "Finds where beacons are, which one is not where the list says, and scale and "
                   "bias of their ranges, by a drive among them. It needs no ground truth.");
  line.positional("bag", "a bag with odometry and ranges");
  line.option<std::string>("output", "FILE",
                           "write beacons and calibration as YAML, for run_bag --config; by "
                           "default it is printed");
  line.option<std::string>("plot", "FILE", "draw path and beacons (.png, .pdf or .svg)");
  line.reads("bag");
  line.writes("output");
  line.writes("plot");
  line.flag("unlisted", "look for all beacons, whatever bag and configuration list");
  add_filter_options(&line);
  line.topic("odom", "/odom", "odometry");
  line.topic("ranges", "/ranges", "ranges");
  line.topic("beacons", "/beacons", "beacons whose places are known, if any");
  line.example("survey_beacons box_of_radios.bag --output beacons.yaml --plot beacons.png");
  line.example("survey_beacons plaza2.bag --output calibration.yaml");
  line.example("run_bag beacon_mcl plaza2.bag out.bag --config calibration.yaml");
  return line;
}

Recording drive_of(const rosbag::Bag& bag, const CommandLine& line) {
  BeaconMclPipelineOptions options;
  apply_filter_options(line, &options);
  const bool is_on_tf = options.odometry_input.source == OdometrySource::tf;
  const std::string odometry = is_on_tf ? "/tf" : line.topic("odom");
  const std::vector<std::string> types =
      is_on_tf ? std::vector<std::string>{"tf2_msgs/TFMessage"} : pose_types();
  require_topics(
      bag, bag.getFileName(),
      {{odometry, types, "--odom"}, {line.topic("ranges"), recorded_range_types(), "--ranges"}});
  Recording drive = read_recording(bag, odometry, line.topic("ranges"), "", options.frames);
  for (const auto& [frame, place] : options.antennas) {
    drive.frames[frame] = Eigen::Translation3d(place);
  }
  if (line.get<bool>("unlisted")) return drive;
  drive.beacons = options.beacons;
  if (drive.beacons.empty()) drive.beacons = read_beacons(bag, line.topic("beacons"));
  return drive;
}

double sigma_of(const RangeMemory::Newest& newest, int at) {
  return std::sqrt(newest.covariance(at, at));
}

void print_findings(const RangeSolution& solution, const std::vector<Beacon>& listed) {
  const RangeMemory& memory = solution.memory;
  std::printf("%d ranges, %d of them outliers; path and places in the frame of %s\n\n",
              solution.ranges, solution.outliers,
              listed.size() >= 2 ? "the listed beacons" : "the first pose");
  for (const RadioKnowledge& radio : memory.radios()) {
    const std::string remark = remark_on(radio, listed);
    std::printf("  %s\n", (remark.empty() ? place_in_words(radio) : remark).c_str());
  }
  const RangeMemory::Newest newest = memory.newest(memory.modes().front());
  constexpr int kConstants = KeyframeUnknown::count;
  const int distance = kConstants + CommonUnknown::distance_scale;
  const int turn = kConstants + CommonUnknown::turn_scale;
  const int lever = kConstants + CommonUnknown::lever_x;
  std::printf("\n  odometry: distances x %.4f ± %.4f, turns x %.4f ± %.4f, %+.2e ± %.0e rad/s\n",
              1.0 + newest.mean[distance], sigma_of(newest, distance), 1.0 + newest.mean[turn],
              sigma_of(newest, turn), newest.mean[KeyframeUnknown::yaw_rate_bias],
              sigma_of(newest, KeyframeUnknown::yaw_rate_bias));
  std::printf(
      "  antenna: %+.2f ± %.2f m ahead, %+.2f ± %.2f m to the left, %+.2f ± %.2f m above "
      "where it is said\n",
      newest.mean[lever], sigma_of(newest, lever), newest.mean[lever + 1],
      sigma_of(newest, lever + 1), newest.mean[lever + 2], sigma_of(newest, lever + 2));
}

PathPlot picture_of(const std::string& title, const RangeSolution& solution,
                    const std::vector<Beacon>& listed) {
  PathPlot plot;
  plot.title = title;
  plot.estimate = solution.path;
  plot.beacons = listed;
  for (const RadioKnowledge& radio : solution.memory.radios()) {
    if (radio.account == RadioAccount::as_listed) continue;
    for (const RadioPlace& place : radio.places) {
      plot.landmarks.push_back({radio.id, place.position, place.covariance});
    }
  }
  return plot;
}

int survey_beacons(const std::vector<std::string>& arguments) {
  CommandLine line = command_line();
  if (!line.parse(arguments)) return 0;
  if (line.has("plot")) check_plot_file(line.text("plot"));
  const auto path = line.text("bag");
  const rosbag::Bag bag = open_bag(path);
  const Recording drive = drive_of(bag, line);
  const RangeSolution solution = solve_ranges(drive);
  std::printf("%s: ", path.c_str());
  print_findings(solution, drive.beacons);
  const std::string name = path.substr(path.find_last_of('/') + 1);
  const std::string yaml = beacon_file(name, solution.memory);
  if (line.has("output")) {
    write_file(line.text("output"), yaml);
    std::printf("wrote %s\n", line.text("output").c_str());
  } else {
    std::printf("\n%s", yaml.c_str());
  }
  if (line.has("plot")) {
    plot_paths(picture_of(name, solution, drive.beacons), line.text("plot"));
    std::printf("wrote %s\n", line.text("plot").c_str());
  }
  return 0;
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  return pf_resampling::run_tool("survey_beacons", argc, argv, pf_resampling::survey_beacons);
}
