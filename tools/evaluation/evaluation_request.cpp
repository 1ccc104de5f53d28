#include "tools/evaluation/evaluation_request.hpp"

#include "tools/common/plot_paths.hpp"

namespace pf_resampling {
namespace {

LandmarkMatching matching_from(const std::string& name) {
  if (name == "auto") return LandmarkMatching::automatic;
  if (name == "id") return LandmarkMatching::id;
  if (name == "nearest") return LandmarkMatching::nearest;
  throw UsageError("--match " + name + ": known are auto, id and nearest");
}

std::string frame_from(const std::string& name) {
  for (const char* known : {"auto", "given", "start", "fit"}) {
    if (name == known) return name;
  }
  throw UsageError("--frame " + name + ": known are auto, given, start and fit");
}

}  // namespace

CommandLine evaluation_command_line() {
  CommandLine line("evaluate_bag",
                   "Errors of an estimated path and map against the ground truth in the same bag.");
  line.positional("bag", "what run_bag or a launch file recorded");
  line.option<double>("clip", "SHARE", 0.0,
                      "share of the time at the start that is left out of the errors; in [0, 1)");
  line.option<std::string>("json", "FILE", "write the figures as JSON");
  line.option<std::string>(
      "plot", "FILE",
      "draw paths and errors (.png, .pdf or .svg); without ground truth only the paths");
  line.reads("bag");
  line.writes("json");
  line.writes("plot");
  line.topic("truth", "/ground_truth",
             "ground truth: PoseStamped, PointStamped, Odometry or PoseWithCovarianceStamped");
  line.option<std::string>(
      "truth-frame", "FRAME",
      "frame on the robot (/tf_static) whose pose is the ground truth, for instance an antenna; by "
      "default ground_truth if that frame exists, otherwise base_link");
  line.topic("pose", "/pose", "estimate: PoseWithCovarianceStamped, Odometry or PoseStamped");
  line.topic("odom", kUsualOdometry, "dead reckoning, if present; 'none' leaves it out");
  line.topic("beacons", "/beacons", "beacons, for the picture and --batch");
  line.topic("landmarks", "/landmarks", "observations, for --batch");
  line.topic("ranges", "/ranges",
             "ranges to the beacons, for --batch where nothing is in landmarks");
  line.option<std::string>("match", "HOW", "auto",
                           "how to match estimated and true landmarks: id, nearest, or auto (by id "
                           "if the sensor gives ids and they fit)");
  line.option<std::string>(
      "frame", "WHICH", "auto",
      "alignment with the truth: given (none), start (at the first true pose), fit (best rigid "
      "fit); auto: given, but with a map started from nothing (no /initialpose, no map loaded) "
      "start, or fit without true headings");
  line.flag("batch",
            "compare with batch least squares on odometry and observations (with their ids or, "
            "without ids, the filter's associations) or on odometry and ranges");
  line.flag("batch-online",
            "with --batch: also solve at every observation with the data up to then, all that a "
            "filter knows; takes minutes for a long drive");
  line.flag("quiet", "print nothing");
  line.example("evaluate_bag out.bag --clip 0.2 --json out.json --plot out.png");
  line.example("evaluate_bag slam.bag --batch");
  line.example("evaluate_bag plaza2.bag --pose /odom --clip 0.2 --batch --batch-online");
  return line;
}

EvaluationRequest evaluation_request_from(const CommandLine& line) {
  EvaluationRequest request;
  request.bag = line.text("bag");
  request.path_options.clip = line.get<double>("clip");
  check_options(request.path_options);
  request.map_options.matching = matching_from(line.text("match"));
  request.frame = frame_from(line.text("frame"));
  request.with_odometry = line.text("odom") != "none";
  request.with_batch = line.get<bool>("batch");
  request.is_quiet = line.get<bool>("quiet");
  request.with_online = line.get<bool>("batch-online");
  request.truth_frame = line.optional<std::string>("truth-frame");
  request.json = line.optional<std::string>("json");
  request.plot = line.optional<std::string>("plot");
  request.truth = line.topic("truth");
  request.pose = line.topic("pose");
  request.odom = line.topic("odom");
  request.beacons = line.topic("beacons");
  request.landmarks = line.topic("landmarks");
  request.ranges = line.topic("ranges");
  if (request.with_online && !request.with_batch) {
    throw UsageError("--batch-online needs --batch");
  }
  if (request.with_batch && !request.with_odometry) {
    throw UsageError("--batch needs the odometry (--odom)");
  }
  if (request.plot) check_plot_file(*request.plot);
  return request;
}

}  // namespace pf_resampling
