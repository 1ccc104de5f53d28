// Repeats comparisons of the papers on a recording: many configurations, many seeds, one table.
#include <algorithm>
#include <cstdio>
#include <thread>

#include "common/bag.hpp"
#include "common/bag_contents.hpp"
#include "common/beacon_mcl_options.hpp"
#include "common/command_line.hpp"
#include "common/files.hpp"
#include "common/progress_bar.hpp"
#include "studies/resampling_study.hpp"

namespace pf_resampling {
namespace {

namespace po = boost::program_options;

CommandLine command_line() {
  CommandLine line("study", "Compares strategies on one recording, each with the same seeds.");
  line.positional("study", "resampling: the schemes of paper M, without and with excitation");
  line.positional("bag", "a recording with odometry, ranges, beacons and ground truth");
  line.options()("seeds", po::value<int>()->default_value(30)->value_name("N"),
                 "runs per configuration, with seeds 1 to N")(
      "schemes", po::value<std::string>()->value_name("A,B"),
      "resampling schemes; the five of paper M if not given")(
      "excitations", po::value<std::string>()->default_value("none,regularized")->value_name("A,B"),
      "excitations")("clip", po::value<double>()->default_value(0.2)->value_name("SHARE"),
                     "share of the time, from the start, left out of the errors; in [0, 1)")(
      "lost-error", po::value<double>()->default_value(0.0)->value_name("METRES"),
      "error above which the robot is lost; 0: 0.2 m + 3 % of the extent of the true path")(
      "jobs", po::value<int>()->value_name("N"), "runs at a time; as many as there are processors")(
      "markdown", po::value<std::string>()->value_name("FILE"),
      "write the tables there; without, they are printed")(
      "json", po::value<std::string>()->value_name("FILE"), "write the figures of every run")(
      "truth", po::value<std::string>()->default_value("/ground_truth")->value_name("TOPIC"),
      "ground truth");
  add_beacon_mcl_options(&line);
  line.example("study resampling plaza2.bag --seeds 30 --markdown plaza2.md");
  line.example("study resampling plaza2.bag --config paper_m.yaml --config calibration.yaml");
  line.example("study resampling plaza2.bag --set particles=200 --schemes systematic,ssp");
  return line;
}

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

ResamplingStudyOptions read_options(const CommandLine& line) {
  ResamplingStudyOptions options;
  options.pipeline = read_beacon_mcl_options(line);
  options.schemes = schemes_of_paper_m();
  if (line.has("schemes")) {
    options.schemes.clear();
    for (const std::string& name : split(line.get<std::string>("schemes"))) {
      options.schemes.push_back(resampling_scheme_from_string(name));
    }
  }
  for (const std::string& name : split(line.get<std::string>("excitations"))) {
    options.excitations.push_back(excitation_from_string(name));
  }
  options.seeds = line.get<int>("seeds");
  const unsigned processors = std::max(1U, std::thread::hardware_concurrency());
  options.jobs = line.has("jobs") ? line.get<int>("jobs") : static_cast<int>(processors);
  options.errors.clip = line.get<double>("clip");
  options.errors.lost_error = line.get<double>("lost-error");
  return options;
}

int study(const std::vector<std::string>& arguments) {
  CommandLine line = command_line();
  if (!line.parse(arguments)) return 0;
  const auto name = line.get<std::string>("study");
  if (name != "resampling") throw UsageError("study '" + name + "' is unknown; known: resampling");
  const auto path = line.get<std::string>("bag");
  const ResamplingStudyOptions options = read_options(line);

  const BeaconMclTopics topics = beacon_mcl_topics(line);
  const std::vector<BeaconMclMessage> messages =
      load_beacon_mcl_messages(path, topics, options.pipeline.beacons.empty());
  const rosbag::Bag bag = open_bag(path);
  const std::string truth_topic = absolute_topic(line.get<std::string>("truth"));
  require_topics(bag, path, {{truth_topic, truth_types(), "--truth"}});
  const std::vector<EstimatedPose> odometry = read_poses(bag, topics.odom);
  const std::vector<TruePose> truth = truth_while_recording(read_truth(bag, truth_topic), odometry);

  ResamplingStudy result;
  {
    ProgressBar bar("study", options.schemes.size() * options.excitations.size() *
                                 static_cast<std::uint64_t>(std::max(0, options.seeds)));
    result = run_resampling_study(path.substr(path.find_last_of('/') + 1), messages, truth,
                                  odometry, options, [&](std::uint64_t done) { bar.update(done); });
  }
  const std::string markdown = to_markdown(result);
  if (line.has("markdown")) {
    write_file(line.get<std::string>("markdown"), markdown);
  } else {
    std::printf("%s", markdown.c_str());
  }
  if (line.has("json")) write_file(line.get<std::string>("json"), to_json_text(result));
  return 0;
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  return pf_resampling::run_tool("study", argc, argv, pf_resampling::study);
}
