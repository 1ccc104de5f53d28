// Judges a run of a filter by the ground truth in the same bag: errors as in Mahmoud (2012), section
// IV, beside those of dead reckoning, errors of the map, whether the filter's own confidence is right,
// and a picture.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>

#include "pf_resampling_core/evaluation/map_errors.hpp"
#include "pf_resampling_core/evaluation/path_errors.hpp"
#include "tools/batch/batch_slam.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/bag_contents.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/evaluation_report.hpp"
#include "tools/common/files.hpp"
#include "tools/common/plot_paths.hpp"

namespace pf_resampling {
namespace {

namespace po = boost::program_options;

CommandLine command_line() {
  CommandLine line("evaluate_bag",
                   "Errors of an estimated path and map against the ground truth in the same bag.");
  line.positional("bag", "what run_bag or a launch file recorded");
  line.options()("clip", po::value<double>()->default_value(0.0)->value_name("SHARE"),
                 "share of the time, from the start, left out of the errors; in [0, 1)")(
      "json", po::value<std::string>()->value_name("FILE"), "write the figures as JSON")(
      "plot", po::value<std::string>()->value_name("FILE"),
      "draw paths and errors (.png, .pdf or .svg); without ground truth the paths alone")(
      "truth", po::value<std::string>()->default_value("/ground_truth")->value_name("TOPIC"),
      "ground truth: PoseStamped, PointStamped, Odometry or PoseWithCovarianceStamped")(
      "truth-frame", po::value<std::string>()->value_name("FRAME"),
      "frame on the robot (/tf_static) whose place the truth is, an antenna's for instance; by "
      "default ground_truth if there is one, else base_link")(
      "pose", po::value<std::string>()->default_value("/pose")->value_name("TOPIC"),
      "estimate: PoseWithCovarianceStamped, Odometry or PoseStamped")(
      "odom", po::value<std::string>()->default_value("/odom")->value_name("TOPIC"),
      "dead reckoning; 'none' leaves it out")(
      "beacons", po::value<std::string>()->default_value("/beacons")->value_name("TOPIC"),
      "beacons, for the picture")(
      "lost-error", po::value<double>()->default_value(0.0)->value_name("METRES"),
      "error above which the robot is lost; 0: 0.2 m + 3 % of the extent of the true path")(
      "max-gap", po::value<double>()->default_value(0.0)->value_name("SECONDS"),
      "longest gap of the estimate to interpolate across; 0: three median intervals, at least 1 s")(
      "landmark-map", po::value<std::string>()->default_value("/landmark_map")->value_name("TOPIC"),
      "estimated map; its last message is judged")(
      "true-landmarks",
      po::value<std::string>()->default_value("/ground_truth_landmarks")->value_name("TOPIC"),
      "true map")("landmarks",
                  po::value<std::string>()->default_value("/landmarks")->value_name("TOPIC"),
                  "observations, for --batch")(
      "path", po::value<std::string>()->default_value("/path")->value_name("TOPIC"),
      "a mapper's whole path as it was believed at the end; its last message is judged")(
      "status", po::value<std::string>()->default_value("/status")->value_name("TOPIC"),
      "the filter's status, for its particles")(
      "particle-errors",
      po::value<std::string>()->default_value("/particle_errors")->value_name("TOPIC"),
      "errors of the particles' poses and maps, as run_bag writes them")(
      "match", po::value<std::string>()->default_value("auto")->value_name("HOW"),
      "which true landmark an estimated one is: id, nearest, or auto: by id if the ids fit")(
      "gate", po::value<double>()->default_value(0.0)->value_name("METRES"),
      "how far the nearest may be; 0: half the usual distance of neighbours, at least 0.5 m")(
      "frame", po::value<std::string>()->default_value("auto")->value_name("WHICH"),
      "the estimate's frame: given (as it is), start (moved to agree at the first true pose), fit "
      "(moved to fit best); auto: given, but start, or fit without true headings, if the bag has a "
      "map and no /initialpose")(
      "batch", po::bool_switch(),
      "compare with the least-squares solution of odometry and observations with ids (Ceres)")(
      "batch-online", po::value<double>()->value_name("SECONDS"),
      "so often, solve with the data so far alone: what no filter, which knows the past only, can "
      "be better than; takes minutes")("quiet", po::bool_switch(), "print nothing");
  line.example("evaluate_bag out.bag --clip 0.2 --json out.json --plot out.png");
  line.example("evaluate_bag slam.bag --batch");
  return line;
}

bool has_topic(const rosbag::Bag& bag, const std::string& name) {
  const std::vector<BagTopic> topics = topics_of(bag);
  return std::any_of(topics.begin(), topics.end(),
                     [&](const BagTopic& topic) { return topic.name == name; });
}

/// The estimate after its first fifth, standing in for a truth that is not there: it tells where to
/// begin dead reckoning.
std::vector<TruePose> reference_of(const std::vector<EstimatedPose>& estimate) {
  std::vector<TruePose> reference;
  for (std::size_t i = estimate.size() / 5; i < estimate.size(); ++i) {
    const EstimatedPose& pose = estimate[i];
    reference.push_back({pose.time, pose.pose.x, pose.pose.y, pose.pose.heading});
  }
  return reference;
}

Pose2 to_pose2(const Eigen::Isometry3d& frame) {
  const Eigen::Matrix3d turn = frame.linear();
  return {frame.translation().x(), frame.translation().y(), std::atan2(turn(1, 0), turn(0, 0))};
}

/// Brings the filter's frame to the truth's. A map that was begun at nothing has a frame of its
/// own, and only its start, or a fit, can tell where that lies.
struct FrameChoice {
  std::string frame = "given";  // "given", "start", "fit"
  Pose2 alignment;
};

FrameChoice choose_frame(const std::string& wanted, bool is_own, const std::vector<TruePose>& truth,
                         const std::vector<EstimatedPose>& estimate,
                         const PathErrorOptions& options) {
  const bool has_heading = std::any_of(
      truth.begin(), truth.end(), [](const TruePose& pose) { return pose.heading.has_value(); });
  FrameChoice choice;
  choice.frame = wanted;
  if (wanted == "auto") choice.frame = !is_own ? "given" : has_heading ? "start" : "fit";
  if (choice.frame == "start") {
    const EstimatedPose first = align_at_start(estimate, truth).front();
    choice.alignment = compose(first.pose, relative(estimate.front().pose, {}));
  } else if (choice.frame == "fit") {
    choice.alignment = evaluate_aligned_path(truth, estimate, options).alignment;
  }
  return choice;
}

LandmarkMatching matching_from(const std::string& name) {
  if (name == "auto") return LandmarkMatching::automatic;
  if (name == "id") return LandmarkMatching::id;
  if (name == "nearest") return LandmarkMatching::nearest;
  throw UsageError("--match " + name + ": known are auto, id and nearest");
}

/// Where on the robot the truth is of.
Pose2 place_of_truth(const rosbag::Bag& bag, const std::optional<std::string>& wanted) {
  const auto frames = read_frames_on_robot(bag, "base_link");
  const auto found = frames.find(wanted.value_or("ground_truth"));
  if (found != frames.end()) return to_pose2(found->second);
  if (!wanted) return {};
  throw Error("--truth-frame " + *wanted +
              ": /tf_static does not place it on base_link; give one that it does");
}

/// The truth at the stamps of a path; not inside its gaps.
std::vector<TruePose> truth_at(const std::vector<EstimatedPose>& path,
                               const std::vector<TruePose>& truth) {
  const double max_gap = usual_max_gap(truth);
  std::vector<TruePose> there;
  for (const EstimatedPose& pose : path) {
    if (const auto true_pose = interpolate(truth, pose.time, max_gap)) there.push_back(*true_pose);
  }
  return there;
}

/// The newest pose of the solution with the data until then, every `period` seconds.
std::vector<EstimatedPose> solve_online(const BatchProblem& problem, double period) {
  std::vector<EstimatedPose> poses;
  const double last = problem.odometry.back().time;
  double time = problem.odometry.front().time;
  while ((time += period) < last) {
    BatchProblem past = problem;
    const auto is_later = [time](const auto& entry) { return entry.time > time; };
    past.odometry.erase(std::find_if(past.odometry.begin(), past.odometry.end(), is_later),
                        past.odometry.end());
    past.scans.erase(std::find_if(past.scans.begin(), past.scans.end(), is_later),
                     past.scans.end());
    const bool sees_any = std::any_of(past.scans.begin(), past.scans.end(), [](const auto& scan) {
      return std::any_of(scan.landmarks.begin(), scan.landmarks.end(),
                         [](const auto& seen) { return seen.id >= 0; });
    });
    poses.push_back(
        sees_any ? solve_batch(past).path.back()
                 : EstimatedPose{past.odometry.back().time,
                                 relative(problem.odometry.front().pose, past.odometry.back().pose),
                                 Eigen::Matrix3d::Zero()});
  }
  return poses;
}

/// Both on line, at the same times, each aligned there.
OnlineComparison compare_online(const BatchProblem& problem, double period, const Pose2& place,
                                const std::vector<TruePose>& truth,
                                const std::vector<EstimatedPose>& estimate) {
  const std::vector<EstimatedPose> poses = path_of_place(solve_online(problem, period), place);
  PathErrorOptions options;
  options.max_gap = std::numeric_limits<double>::max();
  const std::vector<TruePose> there = truth_at(poses, truth);
  OnlineComparison online;
  online.period = period;
  online.batch = evaluate_aligned_path(there, poses, options);
  online.filter = evaluate_aligned_path(there, estimate, options);
  return online;
}

/// The least-squares solution of the bag's odometry and observations, judged as the estimate is.
BatchComparison compare_with_batch(const rosbag::Bag& bag, const std::string& odom_topic,
                                   const std::string& landmarks_topic, const Pose2& place,
                                   const std::vector<TruePose>& truth,
                                   const std::vector<TruePose>& path_truth,
                                   const std::vector<EstimatedPose>& estimate,
                                   const std::optional<double>& online_period,
                                   const std::optional<std::vector<PointLandmark>>& true_map,
                                   const PathErrorOptions& options, const Evaluation& evaluation) {
  BatchProblem problem;
  problem.odometry = read_poses(bag, odom_topic);
  problem.odometry_noise = read_odometry_noise(bag, odom_topic);
  problem.scans = read_landmark_scans(bag, landmarks_topic);
  for (const auto& [name, frame] : read_frames_on_robot(bag, "base_link")) {
    problem.sensors[name] = to_pose2(frame);
  }
  BatchSolution solution = solve_batch(problem);
  solution.path = path_of_place(solution.path, place);
  BatchComparison batch;
  batch.aligned = evaluate_aligned_path(truth, solution.path, options);
  const FrameChoice frame = choose_frame(evaluation.frame == "given" ? "start" : evaluation.frame,
                                         true, truth, solution.path, options);
  batch.errors = evaluate_path(truth, moved(solution.path, frame.alignment), options);
  if (true_map) {
    MapErrorOptions map_options;
    map_options.matching = LandmarkMatching::id;
    batch.map = evaluate_map(moved(solution.landmarks, frame.alignment), *true_map, map_options);
  }
  batch.distance_scale = solution.distance_scale;
  batch.yaw_scale = solution.yaw_scale;
  batch.observations = solution.observations;
  batch.outliers = solution.outliers;
  const auto ratio = [](double of, double by) -> std::optional<double> {
    if (!(by > 0.0)) return std::nullopt;
    return of / by;
  };
  batch.online_ratio =
      ratio(evaluation.estimate_aligned.cartesian.mean, batch.aligned.cartesian.mean);
  batch.path_ratio = batch.online_ratio;
  if (evaluation.path_aligned) {
    batch.path_aligned = evaluate_aligned_path(path_truth, solution.path, options);
    batch.path_ratio =
        ratio(evaluation.path_aligned->cartesian.mean, batch.path_aligned->cartesian.mean);
  }
  if (batch.map && batch.map->rms_aligned && evaluation.map && evaluation.map->rms_aligned) {
    batch.map_ratio = ratio(*evaluation.map->rms_aligned, *batch.map->rms_aligned);
  }
  if (online_period) {
    batch.online = compare_online(problem, *online_period, place, truth, estimate);
  }
  return batch;
}

/// When the part that is left out of the errors ends, s.
double end_of_clipped(const PathErrors& errors) {
  double end = -std::numeric_limits<double>::infinity();
  for (const PathErrorSample& sample : errors.samples) {
    if (sample.is_clipped) end = std::max(end, sample.time);
  }
  return end;
}

int evaluate_bag(const std::vector<std::string>& arguments) {
  CommandLine line = command_line();
  if (!line.parse(arguments)) return 0;
  const auto path = line.get<std::string>("bag");
  const auto topic = [&](const char* option) {
    return absolute_topic(line.get<std::string>(option));
  };
  const bool with_odometry = line.get<std::string>("odom") != "none";
  PathErrorOptions options;
  options.clip = line.get<double>("clip");
  options.lost_error = line.get<double>("lost-error");
  options.max_gap = line.get<double>("max-gap");
  check_options(options);
  MapErrorOptions map_options;
  map_options.matching = matching_from(line.get<std::string>("match"));
  map_options.gate = line.get<double>("gate");
  const auto wanted_frame = line.get<std::string>("frame");
  if (wanted_frame != "auto" && wanted_frame != "given" && wanted_frame != "start" &&
      wanted_frame != "fit") {
    throw UsageError("--frame " + wanted_frame + ": known are auto, given, start and fit");
  }
  const bool with_batch = line.get<bool>("batch");
  std::optional<double> online_period;
  if (line.has("batch-online")) {
    online_period = line.get<double>("batch-online");
    if (!with_batch) throw UsageError("--batch-online belongs to --batch");
    if (!(*online_period > 0.0)) throw UsageError("--batch-online has to be above 0 s");
  }
  if (with_batch && !with_odometry) throw UsageError("--batch needs the odometry (--odom)");
  if (line.has("plot")) check_plot_file(line.get<std::string>("plot"));

  const rosbag::Bag bag = open_bag(path);
  std::vector<NeededTopic> needed = {{topic("pose"), pose_types(), "--pose"}};
  if (with_odometry) needed.push_back({topic("odom"), pose_types(), "--odom"});
  const bool paths_alone = line.has("plot") && !line.has("json") && !has_topic(bag, topic("truth"));
  if (!paths_alone) needed.push_back({topic("truth"), truth_types(), "--truth"});
  if (with_batch) {
    needed.push_back(
        {topic("landmarks"), {"pf_resampling/LandmarkObservationArray"}, "--landmarks"});
  }
  require_topics(bag, path, needed);

  PathPlot plot;
  plot.title = path;
  const Pose2 place =
      place_of_truth(bag, line.has("truth-frame")
                              ? std::optional<std::string>(line.get<std::string>("truth-frame"))
                              : std::nullopt);
  plot.estimate = path_of_place(read_poses(bag, topic("pose")), place);
  plot.beacons = read_beacons(bag, topic("beacons"));
  const auto map = read_landmark_map(bag, topic("landmark-map"));
  const auto true_map = read_landmark_map(bag, topic("true-landmarks"));
  plot.landmarks = map.value_or(std::vector<PointLandmark>());
  plot.is_slam = map.has_value();
  plot.true_landmarks = true_map.value_or(std::vector<PointLandmark>());
  if (with_odometry) {
    plot.dead_reckoning = path_of_place(read_poses(bag, topic("odom")), place);
  }
  if (paths_alone) {
    if (with_odometry) {
      plot.dead_reckoning = align_at_start(plot.dead_reckoning, reference_of(plot.estimate));
    }
    if (!line.get<bool>("quiet")) {
      std::printf("%s: no %s, so no errors: the paths alone are drawn\n", path.c_str(),
                  topic("truth").c_str());
    }
    plot_paths(plot, line.get<std::string>("plot"));
    return 0;
  }

  plot.truth = truth_while_recording(read_truth(bag, topic("truth")), plot.dead_reckoning);
  const bool frame_is_own = map && !has_topic(bag, "/initialpose");
  const FrameChoice frame =
      choose_frame(wanted_frame, frame_is_own, plot.truth, plot.estimate, options);
  plot.estimate = moved(plot.estimate, frame.alignment);
  plot.landmarks = moved(plot.landmarks, frame.alignment);

  Evaluation evaluation;
  evaluation.clip = options.clip;
  evaluation.frame = frame.frame;
  evaluation.is_slam = map.has_value();
  evaluation.estimate = evaluate_path(plot.truth, plot.estimate, options);
  evaluation.estimate_aligned = evaluate_aligned_path(plot.truth, plot.estimate, options);
  std::vector<TruePose> path_truth;
  if (const auto believed = map ? read_path(bag, topic("path")) : std::nullopt) {
    path_truth = truth_at(*believed, plot.truth);
    PathErrorOptions path_options = options;
    path_options.max_gap = std::numeric_limits<double>::max();  // at its own stamps
    if (!path_truth.empty()) {
      evaluation.path_aligned =
          evaluate_aligned_path(path_truth, path_of_place(*believed, place), path_options);
    }
  }
  if (with_odometry) {
    plot.dead_reckoning = align_at_start(plot.dead_reckoning, plot.truth);
    evaluation.dead_reckoning = evaluate_path(plot.truth, plot.dead_reckoning, options);
    evaluation.dead_reckoning_aligned =
        evaluate_aligned_path(plot.truth, plot.dead_reckoning, options);
  }
  if (map && true_map) {
    map_options.first_alignment = evaluation.estimate_aligned.alignment;
    evaluation.map = evaluate_map(plot.landmarks, *true_map, map_options);
  }
  evaluation.particles = summarize(read_particle_errors(bag, topic("particle-errors")),
                                   end_of_clipped(evaluation.estimate));
  evaluation.filter = read_filter_summary(bag, topic("status"));
  if (with_batch) {
    evaluation.batch =
        compare_with_batch(bag, topic("odom"), topic("landmarks"), place, plot.truth, path_truth,
                           plot.estimate, online_period, true_map, options, evaluation);
  }
  plot.map = evaluation.map;
  if (evaluation.is_slam && evaluation.frame != "given") {
    // Where the frame lies is chance: the shapes of path and map are what a picture can show.
    plot.alignment = evaluation.estimate_aligned.alignment;
    if (evaluation.frame != "fit") {
      plot.aligned_errors =
          evaluate_path(plot.truth, moved(plot.estimate, *plot.alignment), options);
    }
  }
  plot.errors = evaluation.estimate;
  plot.dead_reckoning_errors = evaluation.dead_reckoning;

  if (!line.get<bool>("quiet")) print(path, evaluation);
  if (line.has("json")) {
    write_file(line.get<std::string>("json"), to_json(evaluation).dump(2) + "\n");
  }
  if (line.has("plot")) plot_paths(plot, line.get<std::string>("plot"));
  return 0;
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  return pf_resampling::run_tool("evaluate_bag", argc, argv, pf_resampling::evaluate_bag);
}
