// Runs a filter over a bag, in-process and as fast as it goes: the code of the node without ROS
// around it. Same bag, seed and configuration: same bytes, at any number of threads.
#include <rosbag/exceptions.h>
#include <rosbag/view.h>
#include <sys/resource.h>

#include <chrono>
#include <filesystem>
#include <iostream>
#include <set>

#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"
#include "common/bag.hpp"
#include "common/beacon_mcl_bag.hpp"
#include "common/beacon_mcl_options.hpp"
#include "common/command_line.hpp"
#include "common/progress_bar.hpp"
#include "common/table.hpp"
#include "pf_resampling/conversions.hpp"
#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

namespace po = boost::program_options;

/// Topics that the filter writes. Those of an earlier run in the bag are left out.
const std::set<std::string> kOutputTopics = {"/pose",    "/path",   "/particlecloud", "/particles",
                                             "/markers", "/status", "/diagnostics"};

enum class Outputs { all, no_clouds, pose_only };

/// Sinks that write to `writer` at the time `now` points to, count the poses,
/// and gather what it has to say in `log`.
BeaconMclSinks make_sinks(Outputs outputs, const ros::Time* now, BagWriter* writer,
                          std::uint64_t* poses, std::vector<std::string>* log) {
  BeaconMclSinks sinks;
  sinks.pose = [=](const geometry_msgs::PoseWithCovarianceStamped& message) {
    ++*poses;
    writer->write("/pose", *now, message);
  };
  sinks.transform = [=](const geometry_msgs::TransformStamped& transform) {
    tf2_msgs::TFMessage message;
    message.transforms.push_back(transform);
    writer->write("/tf", *now, message);
  };
  sinks.log = [=](LogLevel, const std::string& text) { log->push_back(text); };
  if (outputs == Outputs::pose_only) return sinks;
  sinks.status = [=](const FilterStatus& message) { writer->write("/status", *now, message); };
  sinks.diagnostics = [=](const diagnostic_msgs::DiagnosticArray& message) {
    writer->write("/diagnostics", *now, message);
  };
  if (outputs == Outputs::no_clouds) return sinks;
  sinks.path = [=](const nav_msgs::Path& message) { writer->write("/path", *now, message); };
  sinks.particlecloud = [=](const geometry_msgs::PoseArray& message) {
    writer->write("/particlecloud", *now, message);
  };
  sinks.particles = [=](const sensor_msgs::PointCloud2& message) {
    writer->write("/particles", *now, message);
  };
  sinks.markers = [=](const visualization_msgs::MarkerArray& message) {
    writer->write("/markers", *now, message);
  };
  return sinks;
}

/// Copies an input message; what an earlier run of the filter wrote is left out.
void copy_input(const rosbag::MessageInstance& message, const BeaconMclPipelineOptions& options,
                BagWriter* writer) {
  if (kOutputTopics.count(message.getTopic()) > 0) return;
  if (message.getTopic() == "/tf") {
    const auto transforms = message.instantiate<tf2_msgs::TFMessage>();
    if (transforms) {
      tf2_msgs::TFMessage kept;
      for (const geometry_msgs::TransformStamped& transform : transforms->transforms) {
        if (without_slash(transform.child_frame_id) != options.odom_frame) {
          kept.transforms.push_back(transform);
        }
      }
      if (kept.transforms.size() != transforms->transforms.size()) {
        if (!kept.transforms.empty()) writer->write("/tf", message.getTime(), kept);
        return;
      }
    }
  }
  writer->copy(message);
}

BeaconMclPipelineOptions read_options(const CommandLine& line) {
  BeaconMclPipelineOptions options = read_beacon_mcl_options(line);
  const ParameterList parameters = parameters_of(&options);
  if (line.has("seed")) set_parameter(parameters, "seed", line.get<std::string>("seed"));
  if (line.has("threads")) set_parameter(parameters, "threads", line.get<std::string>("threads"));
  return options;
}

/// Why there is not a single pose, as far as can be told.
std::string why_no_pose(const BeaconMclPipeline& pipeline) {
  if (pipeline.filter() == nullptr) return "the beacons are not known";
  std::string reasons;
  for (const RejectCounter::Count& count : pipeline.rejects().counts()) {
    reasons += (reasons.empty() ? "" : "; ") + std::to_string(count.count) + " " + count.input +
               " rejected, " + to_string(count.reason) + ": " + count.latest;
  }
  return reasons.empty() ? "there are too few ranges" : reasons;
}

double cpu_seconds(const rusage& usage) {
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

int run_beacon_mcl_bag(const CommandLine& line) {
  const auto wall_start = std::chrono::steady_clock::now();
  const auto in_path = line.get<std::string>("in.bag");
  const BeaconMclPipelineOptions options = read_options(line);
  const Outputs outputs = line.has("pose-only")   ? Outputs::pose_only
                          : line.has("no-clouds") ? Outputs::no_clouds
                                                  : Outputs::all;
  const BeaconMclTopics topics = beacon_mcl_topics(line);

  const rosbag::Bag bag = open_bag(in_path);
  require_beacon_mcl_topics(bag, in_path, topics, options.beacons.empty());
  const auto out_path = line.get<std::string>("out.bag");
  std::error_code unknown;
  if (std::filesystem::equivalent(in_path, out_path, unknown)) {
    throw Error(out_path + ": is the input; give the output another name");
  }
  BagWriter writer(out_path);
  ros::Time now;
  std::uint64_t poses = 0;
  std::vector<std::string> log;
  BeaconMclPipeline pipeline(options, make_sinks(outputs, &now, &writer, &poses, &log));

  rosbag::View view(bag);
  const double recorded = (view.getEndTime() - view.getBeginTime()).toSec();
  {
    ProgressBar bar("run_bag", view.size());
    std::uint64_t done = 0;
    try {
      for_each_in_order(&view, topics, [&](const rosbag::MessageInstance& message) {
        now = message.getTime();
        copy_input(message, options, &writer);
        if (const auto input = to_beacon_mcl_message(message, topics)) handle(*input, &pipeline);
        bar.update(++done);
      });
    } catch (const rosbag::BagException& error) {
      throw Error(in_path + ": cannot be read to its end (" + error.what() +
                  "); try: rosbag reindex " + in_path);
    }
  }
  if (poses == 0) throw Error(in_path + ": no pose came out: " + why_no_pose(pipeline));
  writer.finish();

  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const double wall =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_start).count();
  for (const std::string& text : log) std::cout << text << "\n";
  for (const RejectCounter::Count& count : pipeline.rejects().counts()) {
    std::cout << "rejected " << count.count << " of " << count.input << ", "
              << to_string(count.reason) << "\n";
  }
  const BeaconMclStatus& status = pipeline.filter()->status();
  std::cout << poses << " poses, " << status.updates << " updates, " << status.renewals
            << " renewals, " << status.particles << " particles, " << strategy_of(options.filter)
            << "\n";
  std::cout << "wall time " << fixed(wall, 3) << " s, CPU time " << fixed(cpu_seconds(usage), 3)
            << " s, peak memory " << fixed(static_cast<double>(usage.ru_maxrss) / 1024.0, 0)
            << " MiB, " << fixed(recorded / wall, 0) << " x real time (" << fixed(recorded, 1)
            << " s)\n";
  return 0;
}

int run(const std::vector<std::string>& arguments) {
  CommandLine line("run_bag", "Runs a filter over a bag; the output bag holds inputs and outputs.");
  line.positional("filter", "beacon_mcl");
  line.optional_positional("in.bag", "with odometry, ranges and, unless configured, beacons");
  line.optional_positional("out.bag", "to be written");
  add_beacon_mcl_options(&line);
  line.options()("seed", po::value<std::string>()->value_name("N"), "of the random numbers (1)")(
      "threads", po::value<std::string>()->value_name("N"),
      "of computation (1); the result does not depend on it")(
      "no-clouds", "leave out what is for looking at: clouds, path, markers")(
      "pose-only", "write pose and tf only")(
      "parameters", po::value<std::string>()->implicit_value("yaml")->value_name("FORMAT"),
      "print all parameters with the values that the other options give, and end: as a YAML file, "
      "or with =markdown as a table");
  line.example("run_bag beacon_mcl plaza2.bag out.bag --seed 1 --threads 2");
  line.example("run_bag beacon_mcl plaza2.bag out.bag --config calibration.yaml --pose-only");
  line.example("run_bag beacon_mcl --parameters > my.yaml");
  if (!line.parse(arguments)) return 0;
  const auto filter = line.get<std::string>("filter");
  if (filter != "beacon_mcl") {
    throw Error("filter '" + filter + "' is unknown; known is beacon_mcl");
  }
  if (line.has("parameters")) {
    BeaconMclPipelineOptions options = read_options(line);
    const auto format = line.get<std::string>("parameters");
    if (format != "yaml" && format != "markdown") {
      throw UsageError("--parameters is '" + format + "', has to be yaml or markdown");
    }
    const ParameterList parameters = parameters_of(&options);
    std::cout << (format == "yaml" ? to_yaml(parameters) : to_markdown(parameters));
    return 0;
  }
  for (const char* bag : {"in.bag", "out.bag"}) {
    if (!line.has(bag)) throw UsageError(std::string(bag) + " is missing; see run_bag --help");
  }
  return run_beacon_mcl_bag(line);
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  return pf_resampling::run_tool("run_bag", argc, argv, pf_resampling::run);
}
