// Judges a run of a filter by the ground truth in the same bag: errors as in Mahmoud (2012),
// section IV, beside those of dead reckoning, errors of the map, whether the filter's own
// confidence is right, and a picture.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <utility>

#include "pf_resampling_core/evaluation/map_errors.hpp"
#include "pf_resampling_core/evaluation/path_errors.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/bag_contents.hpp"
#include "tools/common/batch_ranges.hpp"
#include "tools/common/batch_slam.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/evaluation_report.hpp"
#include "tools/common/files.hpp"
#include "tools/common/filter_associations.hpp"
#include "tools/common/plot_paths.hpp"

namespace pf_resampling {
namespace {

const char* const kUsualOdometry = "/odom";

CommandLine command_line() {
  CommandLine line("evaluate_bag",
                   "Errors of an estimated path and map against the ground truth in the same bag.");
  line.positional("bag", "what run_bag or a launch file recorded");
  line.option<double>(
      "clip", "SHARE", 0.0,
      "share of the time at the start that does not count for the errors; in [0, 1)");
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
      "frame on the robot (/tf_static) that the truth is about, for instance an antenna; by "
      "default ground_truth if that frame exists, otherwise base_link");
  line.topic("pose", "/pose", "estimate: PoseWithCovarianceStamped, Odometry or PoseStamped");
  line.topic("odom", kUsualOdometry, "dead reckoning, if it is there; 'none' leaves it out");
  line.topic("beacons", "/beacons", "beacons, for the picture and --batch");
  line.option<double>(
      "lost-error", "METRES", 0.0,
      "the robot counts as lost above this error; 0: 0.2 m + 3 % of the extent of the true path");
  line.option<double>(
      "max-gap", "SECONDS", 0.0,
      "longest gap in the estimate to interpolate over; 0: three median intervals, at least 1 s");
  line.topic("landmark-map", "/landmark_map", "estimated map; its last message is evaluated");
  line.topic("true-landmarks", "/ground_truth_landmarks", "true map");
  line.topic("landmarks", "/landmarks", "observations, for --batch");
  line.topic("ranges", "/ranges",
             "ranges to the beacons, for --batch where nothing is in landmarks");
  line.topic("path", "/path",
             "the whole path as the filter believes it at the end; its last message is evaluated");
  line.topic("status", "/status", "the filter's status, for its particles");
  line.topic("particle-errors", "/particle_errors",
             "errors of the particles' poses and maps, as run_bag writes them");
  line.option<std::string>(
      "match", "HOW", "auto",
      "how to match estimated and true landmarks: id, nearest, or auto (by id if the ids fit)");
  line.option<double>(
      "gate", "METRES", 0.0,
      "largest distance to the nearest; 0: half the usual distance of neighbours, at least 0.5 m");
  line.option<std::string>(
      "frame", "WHICH", "auto",
      "how to lay the estimate on the truth: given (as it is), start (so that it agrees at the "
      "first true pose), fit (where it fits best); auto: given; if the bag has a map that was "
      "begun "
      "at nothing (no /initialpose, no map loaded): start, or fit without true headings");
  line.flag("batch",
            "compare with the least-squares solution of odometry and observations, with their ids "
            "or, if they have none, those of the filter's landmarks; or of odometry and ranges to "
            "beacons");
  line.flag("batch-online",
            "with --batch: also solve at every observation with the data until then, which is all "
            "that a filter knows; takes minutes for a long drive");
  line.flag("quiet", "print nothing");
  line.example("evaluate_bag out.bag --clip 0.2 --json out.json --plot out.png");
  line.example("evaluate_bag slam.bag --batch");
  line.example("evaluate_bag plaza2.bag --pose /odom --clip 0.2 --batch --batch-online");
  return line;
}

/// What the command line asks for.
struct Request {
  std::string bag;
  PathErrorOptions path_options;
  MapErrorOptions map_options;
  std::string frame;  // "auto", "given", "start", "fit"
  bool with_odometry = true;
  bool with_batch = false;
  bool with_online = false;
  bool is_quiet = false;
  std::optional<std::string> truth_frame, json, plot;
  std::string truth, pose, odom, beacons, landmark_map, true_landmarks, landmarks, path, status,
      particle_errors, ranges;  // topics
};

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

Request request_from(const CommandLine& line) {
  Request request;
  request.bag = line.text("bag");
  request.path_options.clip = line.get<double>("clip");
  request.path_options.lost_error = line.get<double>("lost-error");
  request.path_options.max_gap = line.get<double>("max-gap");
  check_options(request.path_options);
  request.map_options.matching = matching_from(line.text("match"));
  request.map_options.gate = line.get<double>("gate");
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
  request.landmark_map = line.topic("landmark-map");
  request.true_landmarks = line.topic("true-landmarks");
  request.landmarks = line.topic("landmarks");
  request.ranges = line.topic("ranges");
  request.path = line.topic("path");
  request.status = line.topic("status");
  request.particle_errors = line.topic("particle-errors");
  if (request.with_online && !request.with_batch) {
    throw UsageError("--batch-online needs --batch");
  }
  if (request.with_batch && !request.with_odometry) {
    throw UsageError("--batch needs the odometry (--odom)");
  }
  if (request.plot) check_plot_file(*request.plot);
  return request;
}

/// Whether there is nothing to judge by, and a picture of the paths is all that is wanted.
bool is_for_paths_alone(const rosbag::Bag& bag, const Request& request) {
  return request.plot && !request.json && !has_topic(bag, request.truth);
}

/// Whether the batch solution is that of ranges to beacons.
bool is_of_ranges(const rosbag::Bag& bag, const Request& request) {
  return !has_topic(bag, request.landmarks) && has_topic(bag, request.ranges);
}

void require_topics(const rosbag::Bag& bag, const Request& request) {
  std::vector<NeededTopic> needed = {{request.pose, pose_types(), "--pose"}};
  if (request.with_odometry) needed.push_back({request.odom, pose_types(), "--odom"});
  if (!is_for_paths_alone(bag, request)) {
    needed.push_back({request.truth, truth_types(), "--truth"});
  }
  if (request.with_batch && is_of_ranges(bag, request)) {
    needed.push_back({request.ranges, {"pf_resampling/BeaconRange"}, "--ranges"});
    needed.push_back({request.beacons, {"pf_resampling/BeaconArray"}, "--beacons"});
  } else if (request.with_batch) {
    needed.push_back(
        {request.landmarks, {"pf_resampling/LandmarkObservationArray"}, "--landmarks"});
  }
  require_topics(bag, request.bag, needed);
}

/// The estimate after its first fifth, in the place of a truth that is missing: dead reckoning is
/// drawn from there.
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

/// The place on the robot that the truth is about.
Pose2 place_of_truth(const rosbag::Bag& bag, const std::optional<std::string>& wanted) {
  const auto frames = read_frames_on_robot(bag, "base_link");
  const auto found = frames.find(wanted.value_or("ground_truth"));
  if (found != frames.end()) return to_pose2(found->second);
  if (!wanted) return {};
  throw Error("--truth-frame " + *wanted +
              ": /tf_static does not place it on base_link; give one that it does");
}

/// What the bag holds of a run.
struct Recorded {
  Pose2 place;                                // on the robot, of truth and paths
  std::vector<TruePose> truth;                // while there is odometry
  std::vector<EstimatedPose> estimate;        // of the place, as all paths are
  std::vector<EstimatedPose> dead_reckoning;  // empty if it is not asked for
  std::optional<std::vector<EstimatedPose>>
      believed;  // the whole path at the end, if there is a map
  std::vector<Beacon> beacons;
  std::optional<std::vector<PointLandmark>> map, true_map;
  bool has_initial_pose = false;
  std::optional<FilterSummary> filter;
};

/// All but the truth.
Recorded read_run(const rosbag::Bag& bag, const Request& request) {
  Recorded run;
  run.place = place_of_truth(bag, request.truth_frame);
  run.estimate = path_of_place(read_poses(bag, request.pose), run.place);
  run.beacons = read_beacons(bag, request.beacons);
  run.map = read_landmark_map(bag, request.landmark_map);
  run.true_map = read_landmark_map(bag, request.true_landmarks);
  if (request.with_odometry) {
    run.dead_reckoning = path_of_place(read_poses(bag, request.odom), run.place);
  }
  if (const auto path = run.map ? read_path(bag, request.path) : std::nullopt) {
    run.believed = path_of_place(*path, run.place);
  }
  run.filter = read_filter_summary(bag, request.status);
  run.has_initial_pose = has_topic(bag, "/initialpose");
  return run;
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

BatchProblem batch_problem_of(const rosbag::Bag& bag, const Request& request) {
  BatchProblem problem;
  problem.odometry = read_poses(bag, request.odom);
  problem.odometry_noise = read_odometry_noise(bag, request.odom);
  problem.scans = read_landmark_scans(bag, request.landmarks);
  for (const auto& [name, frame] : read_frames_on_robot(bag, "base_link")) {
    problem.sensors[name] = to_pose2(frame);
  }
  return problem;
}

/// Where no observation has an id: those of the landmarks that it is of by the filter's last path
/// and map. False if there are ids, or no such path and map.
bool take_ids_of_filter(const rosbag::Bag& bag, const Request& request, BatchProblem* problem) {
  for (const StampedScan& scan : problem->scans) {
    for (const SeenLandmark& seen : scan.landmarks) {
      if (seen.id >= 0) return false;
    }
  }
  const auto path = read_path(bag, request.path);
  const auto map = read_landmark_map(bag, request.landmark_map);
  if (!path || path->empty() || !map || map->empty()) return false;
  problem->scans =
      associated_by({*path, *map}, problem->odometry, problem->sensors, std::move(problem->scans));
  return true;
}

/// The solution begins to look for the robot where the truth begins.
RangeProblem range_problem_of(const rosbag::Bag& bag, const Request& request, const Recorded& run) {
  RangeProblem problem;
  problem.odometry = read_poses(bag, request.odom);
  problem.odometry_noise = read_odometry_noise(bag, request.odom);
  problem.ranges = read_ranges(bag, request.ranges);
  problem.beacons = run.beacons;
  for (const auto& [name, frame] : read_frames_on_robot(bag, "base_link")) {
    problem.antennas[name] = frame.translation();
  }
  problem.antennas[""] = Eigen::Vector3d::Zero();
  const Pose2 first = align_at_start(run.dead_reckoning, run.truth).front().pose;
  problem.start = compose(first, relative(run.place, {}));
  return problem;
}

/// Brings a solution, which begins at its origin, to the truth's frame as the estimate was.
FrameChoice frame_of_solution(const std::vector<EstimatedPose>& path,
                              const std::string& frame_of_estimate, const Recorded& run,
                              const PathErrorOptions& options) {
  return choose_frame(frame_of_estimate == "given" ? "start" : frame_of_estimate, true, run.truth,
                      path, options);
}

/// The errors of the solution, found in the same way as those of the estimate.
BatchComparison judge_batch(const BatchSolution& solution, bool has_ids_of_filter,
                            const std::string& frame_of_estimate, const Recorded& run,
                            const PathErrorOptions& options) {
  BatchComparison batch;
  batch.has_ids_of_filter = has_ids_of_filter;
  batch.aligned = evaluate_aligned_path(run.truth, solution.path, options);
  const FrameChoice frame = frame_of_solution(solution.path, frame_of_estimate, run, options);
  batch.errors = evaluate_path(run.truth, moved(solution.path, frame.alignment), options);
  if (run.true_map) {
    MapErrorOptions map_options;
    map_options.matching = has_ids_of_filter ? LandmarkMatching::nearest : LandmarkMatching::id;
    map_options.first_alignment =
        compose(batch.aligned.alignment, relative(frame.alignment, Pose2{}));
    batch.map =
        evaluate_map(moved(solution.landmarks, frame.alignment), *run.true_map, map_options);
  }
  batch.distance_scale = solution.distance_scale;
  batch.yaw_scale = solution.yaw_scale;
  batch.observations = solution.observations;
  batch.outliers = solution.outliers;
  return batch;
}

std::optional<double> ratio(double of, double by) {
  if (!(by > 0.0)) return std::nullopt;
  return of / by;
}

/// The filter's errors over those of the solution.
void add_ratios(const Evaluation& evaluation, BatchComparison* batch) {
  batch->online_ratio =
      ratio(evaluation.estimate_aligned.cartesian.mean, batch->aligned.cartesian.mean);
  batch->path_ratio = batch->path_aligned ? ratio(evaluation.path_aligned->cartesian.mean,
                                                  batch->path_aligned->cartesian.mean)
                                          : batch->online_ratio;
  if (batch->map && batch->map->rms_aligned && evaluation.map && evaluation.map->rms_aligned) {
    batch->map_ratio = ratio(*evaluation.map->rms_aligned, *batch->map->rms_aligned);
  }
}

/// What least squares says while the robot drives, judged as the poses that the filter gave out;
/// `alignment` brings its path to the truth's frame.
OnlineBound judge_online(const OnlineSolution& solution, const std::vector<EstimatedPose>& path,
                         const Pose2& alignment, const Recorded& run,
                         const PathErrorOptions& options, const Evaluation& evaluation) {
  OnlineBound bound;
  bound.solutions = solution.solutions;
  bound.refused = solution.refused;
  bound.errors = evaluate_path(run.truth, moved(path, alignment), options);
  bound.aligned = evaluate_aligned_path(run.truth, path, options);
  bound.ratio = ratio(evaluation.estimate.cartesian.mean, bound.errors.cartesian.mean);
  bound.aligned_ratio =
      ratio(evaluation.estimate_aligned.cartesian.mean, bound.aligned.cartesian.mean);
  return bound;
}

/// The least-squares solution of the bag's odometry and observations, judged as the estimate is.
BatchComparison compare_with_batch(const rosbag::Bag& bag, const Recorded& run,
                                   const Request& request, const Evaluation& evaluation) {
  BatchProblem problem = batch_problem_of(bag, request);
  const bool has_ids_of_filter = take_ids_of_filter(bag, request, &problem);
  BatchSolution solution = solve_batch(problem);
  solution.path = path_of_place(solution.path, run.place);
  BatchComparison batch =
      judge_batch(solution, has_ids_of_filter, evaluation.frame, run, request.path_options);
  if (evaluation.path_aligned) {
    batch.path_aligned = evaluate_aligned_path(truth_at(*run.believed, run.truth), solution.path,
                                               request.path_options);
  }
  add_ratios(evaluation, &batch);
  if (request.with_online) {
    const OnlineSolution online = solve_online(problem);
    const std::vector<EstimatedPose> path = path_of_place(online.path, run.place);
    const FrameChoice frame = frame_of_solution(path, evaluation.frame, run, request.path_options);
    batch.online =
        judge_online(online, path, frame.alignment, run, request.path_options, evaluation);
  }
  return batch;
}

/// The same of odometry and ranges: the beacons' frame is the truth's.
BatchComparison compare_with_batch(const RangeProblem& problem, const Recorded& run,
                                   const Request& request, const Evaluation& evaluation) {
  const PathErrorOptions& options = request.path_options;
  const RangeSolution solution = solve_ranges(problem);
  const std::vector<EstimatedPose> path = path_of_place(solution.path, run.place);
  BatchComparison batch;
  batch.errors = evaluate_path(run.truth, path, options);
  batch.aligned = evaluate_aligned_path(run.truth, path, options);
  batch.distance_scale = solution.distance_scale;
  batch.yaw_scale = solution.yaw_scale;
  batch.observations = solution.ranges;
  batch.outliers = solution.outliers;
  batch.radios = RadioComparison{solution.radios, solution.scales, solution.yaw_rate_bias};
  add_ratios(evaluation, &batch);
  if (request.with_online) {
    const OnlineSolution online = solve_ranges_online(problem, solution.scales);
    batch.online = judge_online(online, path_of_place(online.path, run.place), Pose2{}, run,
                                options, evaluation);
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

/// The whole path as it was believed at the end, at its own stamps.
std::optional<AlignedPathErrors> judge_believed(const Recorded& run, PathErrorOptions options) {
  if (!run.believed) return std::nullopt;
  const std::vector<TruePose> truth = truth_at(*run.believed, run.truth);
  if (truth.empty()) return std::nullopt;
  options.max_gap = std::numeric_limits<double>::max();
  return evaluate_aligned_path(truth, *run.believed, options);
}

/// Everything that truth and run say together; the run is in the truth's frame.
Evaluation evaluate(const Recorded& run, const std::string& frame, const Request& request) {
  const PathErrorOptions& options = request.path_options;
  Evaluation evaluation;
  evaluation.clip = options.clip;
  evaluation.frame = frame;
  evaluation.is_slam = run.map.has_value();
  evaluation.estimate = evaluate_path(run.truth, run.estimate, options);
  evaluation.estimate_aligned = evaluate_aligned_path(run.truth, run.estimate, options);
  evaluation.path_aligned = judge_believed(run, options);
  if (request.with_odometry) {
    evaluation.dead_reckoning = evaluate_path(run.truth, run.dead_reckoning, options);
    evaluation.dead_reckoning_aligned =
        evaluate_aligned_path(run.truth, run.dead_reckoning, options);
  }
  if (run.map && run.true_map) {
    MapErrorOptions map_options = request.map_options;
    // The map goes with the path as it was believed at the end, not with what was said on the way.
    const AlignedPathErrors& shape =
        evaluation.path_aligned ? *evaluation.path_aligned : evaluation.estimate_aligned;
    map_options.first_alignment = shape.alignment;
    evaluation.map = evaluate_map(*run.map, *run.true_map, map_options);
  }
  return evaluation;
}

PathPlot picture_of(const Recorded& run, const std::string& title) {
  PathPlot plot;
  plot.title = title;
  plot.truth = run.truth;
  plot.estimate = run.estimate;
  plot.dead_reckoning = run.dead_reckoning;
  plot.beacons = run.beacons;
  plot.is_slam = run.map.has_value();
  plot.landmarks = run.map.value_or(std::vector<PointLandmark>());
  plot.true_landmarks = run.true_map.value_or(std::vector<PointLandmark>());
  return plot;
}

PathPlot picture_of(const Recorded& run, const Evaluation& evaluation, const Request& request) {
  PathPlot plot = picture_of(run, request.bag);
  plot.errors = evaluation.estimate;
  plot.dead_reckoning_errors = evaluation.dead_reckoning;
  plot.map = evaluation.map;
  if (evaluation.is_slam && evaluation.frame != "given") {
    // Where the frame lies is chance: the shapes of path and map are what a picture can show.
    plot.alignment = evaluation.estimate_aligned.alignment;
    if (evaluation.frame != "fit") {
      plot.aligned_errors =
          evaluate_path(run.truth, moved(run.estimate, *plot.alignment), request.path_options);
    }
  }
  return plot;
}

void draw_paths_alone(Recorded run, const Request& request) {
  if (request.with_odometry) {
    run.dead_reckoning = align_at_start(run.dead_reckoning, reference_of(run.estimate));
  }
  if (!request.is_quiet) {
    std::printf("%s: no %s, so there are no errors; only the paths are drawn\n",
                request.bag.c_str(), request.truth.c_str());
  }
  plot_paths(picture_of(run, request.bag), *request.plot);
}

/// Brings estimate, map and dead reckoning to the truth's frame; returns how.
std::string lay_on_truth(const Request& request, Recorded* run) {
  const bool has_loaded = run->filter && !run->filter->map_file.empty();
  const bool frame_is_own = run->map && !run->has_initial_pose && !has_loaded;
  const FrameChoice frame =
      choose_frame(request.frame, frame_is_own, run->truth, run->estimate, request.path_options);
  run->estimate = moved(run->estimate, frame.alignment);
  if (run->map) run->map = moved(*run->map, frame.alignment);
  if (run->believed) run->believed = moved(*run->believed, frame.alignment);
  if (request.with_odometry) run->dead_reckoning = align_at_start(run->dead_reckoning, run->truth);
  return frame.frame;
}

/// Judges what the bag says against its truth; changes the run to the truth's frame.
Evaluation judged(const rosbag::Bag& bag, const Request& request, Recorded* run) {
  run->truth = truth_while_recording(read_truth(bag, request.truth), run->dead_reckoning);
  const std::string frame = lay_on_truth(request, run);
  Evaluation evaluation = evaluate(*run, frame, request);
  evaluation.particles = summarize(read_particle_errors(bag, request.particle_errors),
                                   end_of_clipped(evaluation.estimate));
  evaluation.filter = run->filter;
  evaluation.health = health_shares(read_health(bag, request.status), evaluation.estimate);
  if (request.with_batch) {
    evaluation.batch =
        is_of_ranges(bag, request)
            ? compare_with_batch(range_problem_of(bag, request, *run), *run, request, evaluation)
            : compare_with_batch(bag, *run, request, evaluation);
  }
  return evaluation;
}

int evaluate_bag(const std::vector<std::string>& arguments) {
  CommandLine line = command_line();
  if (!line.parse(arguments)) return 0;
  Request request = request_from(line);
  const rosbag::Bag bag = open_bag(request.bag);
  // Where odometry was on /tf, there is no dead reckoning to compare with.
  const bool is_asked_for = request.odom != kUsualOdometry || request.with_batch;
  if (!is_asked_for && !has_topic(bag, request.odom)) request.with_odometry = false;
  require_topics(bag, request);
  Recorded run = naming(request.bag, [&] { return read_run(bag, request); });
  if (is_for_paths_alone(bag, request)) {
    draw_paths_alone(run, request);
    return 0;
  }
  const Evaluation evaluation = naming(request.bag, [&] { return judged(bag, request, &run); });
  if (!request.is_quiet) print(request.bag, evaluation);
  if (request.json) write_file(*request.json, to_json(evaluation).dump(2) + "\n");
  if (request.plot) plot_paths(picture_of(run, evaluation, request), *request.plot);
  return 0;
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  return pf_resampling::run_tool("evaluate_bag", argc, argv, pf_resampling::evaluate_bag);
}
