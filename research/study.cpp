// Repeats comparisons of the papers: many filters, many seeds; figures as table, JSON and CSV.
#include <algorithm>
#include <cstdio>
#include <thread>

#include "research/studies/compensation_study.hpp"
#include "research/studies/fault_study.hpp"
#include "research/studies/resampling_study.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/bag_contents.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/files.hpp"
#include "tools/common/filter_options.hpp"
#include "tools/common/filter_topics.hpp"
#include "tools/common/progress_bar.hpp"
#include "tools/worlds/world_file.hpp"

namespace pf_resampling {

/// Of a filter without a pipeline, which is that of Kwak (2008) with some values changed.
static void apply(const Configuration& configuration, FastSlamOptions* options) {
  Configuration values = configuration;
  const auto preset = values.values.find("preset");
  if (preset != values.values.end()) {
    if (preset->second != "kwak2008") {
      throw Error("parameter preset is '" + preset->second +
                  "', has to be kwak2008, which this study is about; set single values instead");
    }
    values.values.erase(preset);
  }
  apply_values(values, parameters_of(options));
}

namespace {

std::vector<std::string> split(const std::string& list) {
  std::vector<std::string> words(1);
  for (const char character : list) {
    if (character == ',') {
      words.emplace_back();
    } else {
      words.back() += character;
    }
  }
  return words;
}

/// What every study can be told.
void add_study_options(CommandLine* line, int seeds) {
  line->option<int>("seeds", "N", seeds, "runs per configuration, with seeds 1 to N");
  line->option<int>("jobs", "N", "runs at a time (default: the number of processors)");
  line->option<std::string>("json", "FILE",
                            "write all figures: of every run, and what the table sums up");
  line->option<std::string>("csv", "FILE", "write a row of figures for every run");
  for (const char* name : {"bag", "world"}) line->reads(name);
  for (const char* name : {"json", "csv"}) line->writes(name);
}

int jobs_of(const CommandLine& line) {
  const unsigned processors = std::max(1U, std::thread::hardware_concurrency());
  return line.has("jobs") ? line.get<int>("jobs") : static_cast<int>(processors);
}

void write(const CommandLine& line, const StudyReport& report) {
  std::printf("%s", to_text(report).c_str());
  if (line.has("json")) write_file(line.text("json"), to_json_text(report));
  if (line.has("csv")) write_file(line.text("csv"), to_csv(report));
}

std::string file_name(const std::string& path) {
  return path.substr(path.find_last_of('/') + 1);
}

ResamplingStudyOptions read_resampling_options(const CommandLine& line) {
  ResamplingStudyOptions options;
  apply_filter_options(line, &options.pipeline);
  options.schemes = schemes_of_mahmoud();
  if (line.has("schemes")) {
    options.schemes.clear();
    for (const std::string& name : split(line.text("schemes"))) {
      options.schemes.push_back(from_string<ResamplingScheme>(name));
    }
  }
  for (const std::string& name : split(line.text("excitations"))) {
    options.excitations.push_back(from_string<Excitation>(name));
  }
  options.seeds = line.get<int>("seeds");
  options.jobs = jobs_of(line);
  options.errors.clip = line.get<double>("clip");
  options.errors.lost_error = line.get<double>("lost-error");
  return options;
}

int study_resampling(const std::vector<std::string>& arguments) {
  CommandLine line(
      "study resampling",
      "Compares the resampling schemes of Mahmoud et al. (2012), without and with excitation, on\n"
      "one recording, each with the same seeds.");
  line.positional("bag", "a recording with odometry, ranges, beacons and ground truth");
  line.option<std::string>("schemes", "A,B",
                           "resampling schemes; the five of Mahmoud et al. if not given");
  line.option<std::string>("excitations", "A,B", "none,regularized", "excitations");
  line.option<double>(
      "clip", "SHARE", 0.2,
      "share of the time at the start that does not count for the errors; in [0, 1)");
  line.option<double>(
      "lost-error", "METRES", 0.0,
      "the robot counts as lost above this error; 0: 0.2 m + 3 % of the extent of the true path");
  line.topic("truth", "/ground_truth", "ground truth");
  add_study_options(&line, 30);
  add_filter_options(&line);
  add_beacon_mcl_topics(&line);
  line.example("study resampling plaza2.bag --seeds 30 --csv plaza2.csv");
  line.example("study resampling plaza2.bag --config mahmoud2012.yaml --config calibration.yaml");
  line.example("study resampling plaza2.bag --set particles=200 --schemes systematic,ssp");
  if (!line.parse(arguments)) return 0;
  const auto path = line.text("bag");
  const ResamplingStudyOptions options = read_resampling_options(line);

  const BeaconMclTopics topics = beacon_mcl_topics(line);
  const std::vector<BeaconMclMessage> messages =
      load_beacon_mcl_messages(path, topics, options.pipeline.beacons.empty());
  const rosbag::Bag bag = open_bag(path);
  const std::string truth_topic = line.topic("truth");
  require_topics(bag, path, {{truth_topic, truth_types(), "--truth"}});
  const std::vector<EstimatedPose> odometry = read_poses(bag, topics.odom);
  const std::vector<TruePose> truth = truth_while_recording(read_truth(bag, truth_topic), odometry);

  ResamplingStudy result;
  {
    ProgressBar bar("study", options.schemes.size() * options.excitations.size() *
                                 static_cast<std::uint64_t>(std::max(0, options.seeds)));
    result = run_resampling_study(file_name(path), messages, truth, odometry, options,
                                  [&](std::uint64_t done) { bar.update(done); });
  }
  write(line, report_of(result));
  return 0;
}

FastSlamOptions read_fastslam_options(const CommandLine& line) {
  FastSlamOptions options = kwak2008_options();
  apply_filter_options(line, &options);
  return options;
}

int study_compensation(const std::vector<std::string>& arguments) {
  CommandLine line(
      "study compensation",
      "Compares compensation with resampling in FastSLAM, as Kwak, Kim and Lee (2008) do, on\n"
      "simulated drives through one world, each filter on the same drives. The filter is theirs\n"
      "(the preset kwak2008). It expects the noise of the world indoor_two_loops;\n"
      "for another world set its noise with --set.");
  line.optional_positional("world", "name of a world, or its YAML file; indoor_two_loops");
  line.option<std::string>("variants", "A,B",
                           "filters to compare, by their names in the tables; by default all");
  add_study_options(&line, 100);
  line.repeatable_option(
      "config", "FILE",
      "YAML file of parameters that override theirs; may be repeated, later ones win");
  line.reads("config");
  line.repeatable_option("set", "NAME=VALUE",
                         "one parameter, for instance sensor/range_sigma=0.2; may be repeated");
  line.example("study compensation --json study.json");
  line.example("study compensation --seeds 1000 --variants RSR,compensation");
  if (!line.parse(arguments)) return 0;
  CompensationStudyOptions options;
  options.base = read_fastslam_options(line);
  options.variants = line.has("variants") ? compensation_variants(split(line.text("variants")))
                                          : all_compensation_variants();
  options.drives = line.get<int>("seeds");
  options.jobs = jobs_of(line);
  const World world = load_world(line.has("world") ? line.text("world") : "indoor_two_loops");
  CompensationStudy result;
  {
    ProgressBar bar("study", static_cast<std::uint64_t>(std::max(0, options.drives)));
    result = run_compensation_study(world, options, [&](std::uint64_t done) { bar.update(done); });
  }
  write(line, report_of(result));
  return 0;
}

int study_faults(const std::vector<std::string>& arguments) {
  CommandLine line(
      "study faults",
      "What a filter does, and what it says, when something goes wrong: each fault is put into\n"
      "the recording by itself.");
  line.positional("bag", "a recording with ground truth and beacon ranges, or landmarks");
  line.option<double>("share", "SHARE", 0.4, "share of the drive before the fault");
  line.option<std::string>("fault", "WORDS", "",
                           "only faults whose name contains this, besides no fault and kidnapping");
  add_study_options(&line, 20);
  add_filter_options(&line);
  line.example("study faults plaza2.bag --csv faults.csv");
  line.example("study faults plaza2.bag --fault 'an hour ahead' --seeds 3");
  if (!line.parse(arguments)) return 0;
  const auto path = line.text("bag");
  const RecordedDrive drive = read_drive(path);
  FaultStudyOptions options;
  if (drive.beacons.empty()) {
    apply_filter_options(line, &options.fastslam);
  } else {
    apply_filter_options(line, &options.beacon_mcl);
  }
  options.share = line.get<double>("share");
  options.only = line.text("fault");
  options.seeds = line.get<int>("seeds");
  options.jobs = jobs_of(line);
  ProgressBar bar("study", 30 * static_cast<std::uint64_t>(std::max(0, options.seeds)));
  const FaultStudy result = run_fault_study(file_name(path), drive, options,
                                            [&](std::uint64_t done) { bar.update(done); });
  write(line, report_of(result));
  return 0;
}

const char* const kHelp =
    "Usage: rosrun pf_resampling study STUDY [arguments]\n"
    "\n"
    "Repeats comparisons of the papers: many filters, many seeds, one table.\n"
    "\n"
    "Studies (study STUDY --help says more):\n"
    "  resampling     resampling schemes in range-beacon localization, on a recording (Mahmoud "
    "2012)\n"
    "  compensation   compensation and resampling in FastSLAM, on simulated drives (Kwak 2008)\n"
    "  faults         what filters do, and say, when something goes wrong on a recording\n";

int study(const std::vector<std::string>& arguments) {
  if (arguments.empty()) {
    throw UsageError("which study? resampling, compensation or faults; see study --help");
  }
  const std::string& name = arguments.front();
  if (name == "--help") {
    std::printf("%s", kHelp);
    return 0;
  }
  const std::vector<std::string> rest(arguments.begin() + 1, arguments.end());
  if (name == "resampling") return study_resampling(rest);
  if (name == "compensation") return study_compensation(rest);
  if (name == "faults") return study_faults(rest);
  throw UsageError("study '" + name + "' is unknown; known: resampling, compensation, faults");
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  return pf_resampling::run_tool("study", argc, argv, pf_resampling::study);
}
