// Judges a run of a filter by the ground truth in the same bag: errors as in Mahmoud (2012),
// section IV, beside those of dead reckoning, errors of the map, whether the filter's own
// confidence is right, and a picture.
#include <algorithm>
#include <cstdio>
#include <limits>
#include <optional>
#include <utility>

#include "pf_resampling_core/evaluation/map_errors.hpp"
#include "pf_resampling_core/evaluation/path_errors.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/bag_contents.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/evaluation_report.hpp"
#include "tools/common/files.hpp"
#include "tools/common/filter_topics.hpp"
#include "tools/common/plot_paths.hpp"
#include "tools/evaluation/batch_comparison.hpp"
#include "tools/evaluation/evaluation_request.hpp"
#include "tools/evaluation/recorded_run.hpp"

namespace pf_resampling {
namespace {

/// Whether there is nothing to judge by, and a picture of the paths is all that is wanted.
bool is_for_paths_alone(const rosbag::Bag& bag, const EvaluationRequest& request) {
  return request.plot && !request.json && !has_topic(bag, request.truth);
}

void require_topics(const rosbag::Bag& bag, const EvaluationRequest& request) {
  std::vector<NeededTopic> needed = {{request.pose, pose_types(), "--pose"}};
  if (request.with_odometry) needed.push_back({request.odom, pose_types(), "--odom"});
  if (!is_for_paths_alone(bag, request)) {
    needed.push_back({request.truth, truth_types(), "--truth"});
  }
  if (request.with_batch && is_of_ranges(bag, request)) {
    needed.push_back({request.ranges, recorded_range_types(), "--ranges"});
    needed.push_back({request.beacons, {"pf_resampling/BeaconArray"}, "--beacons"});
  } else if (request.with_batch) {
    needed.push_back({request.landmarks, landmark_types(), "--landmarks"});
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

/// The whole path as it was believed at the end, at its own stamps.
std::optional<AlignedPathErrors> judge_believed(const RecordedRun& run, PathErrorOptions options) {
  if (!run.believed) return std::nullopt;
  const std::vector<TruePose> truth = truth_at(*run.believed, run.truth);
  if (truth.empty()) return std::nullopt;
  options.max_gap = std::numeric_limits<double>::max();
  return evaluate_aligned_path(truth, *run.believed, options);
}

/// Everything that truth and run say together; the run is in the truth's frame.
Evaluation evaluate(const RecordedRun& run, const std::string& frame,
                    const EvaluationRequest& request) {
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

PathPlot picture_of(const RecordedRun& run, const std::string& title) {
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

PathPlot picture_of(const RecordedRun& run, const Evaluation& evaluation,
                    const EvaluationRequest& request) {
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

void draw_paths_alone(RecordedRun run, const EvaluationRequest& request) {
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
std::string lay_on_truth(const EvaluationRequest& request, RecordedRun* run) {
  const bool has_loaded = run->filter && !run->filter->map_file.empty();
  const bool frame_is_own = run->map && !run->has_initial_pose && !has_loaded;
  const std::string wanted =
      frame_is_own && run->finds_beacons && request.frame == "auto" ? "fit" : request.frame;
  const FrameChoice frame =
      choose_frame(wanted, frame_is_own, run->truth, run->estimate, request.path_options);
  run->estimate = moved(run->estimate, frame.alignment);
  if (run->map) run->map = moved(*run->map, frame.alignment);
  if (run->believed) run->believed = moved(*run->believed, frame.alignment);
  if (request.with_odometry) run->dead_reckoning = align_at_start(run->dead_reckoning, run->truth);
  return frame.frame;
}

/// Whether landmarks were seen, and none of them had an id: those of the map are numbers that the
/// filter gave.
bool are_seen_without_ids(const rosbag::Bag& bag) {
  bool is_seen = false;
  const std::vector<std::string> types = landmark_types();
  for (const BagTopic& topic : topics_of(bag)) {
    if (std::find(types.begin(), types.end(), topic.type) == types.end()) continue;
    for (const StampedScan& scan : read_landmark_scans(bag, topic.name)) {
      for (const SeenLandmark& landmark : scan.landmarks) {
        if (landmark.id >= 0) return false;
        is_seen = true;
      }
    }
  }
  return is_seen;
}

/// Judges what the bag says against its truth; changes the run to the truth's frame.
Evaluation judged(const rosbag::Bag& bag, const EvaluationRequest& request, RecordedRun* run) {
  run->truth = truth_while_recording(read_truth(bag, request.truth), run->dead_reckoning);
  const std::string frame = lay_on_truth(request, run);
  Evaluation evaluation = evaluate(*run, frame, request);
  evaluation.filter = run->filter;
  evaluation.health = health_shares(read_health(bag, kStatus), evaluation.estimate);
  if (request.with_batch) {
    evaluation.batch = compare_with_batch(bag, *run, request, evaluation);
  }
  return evaluation;
}

int evaluate_bag(const std::vector<std::string>& arguments) {
  CommandLine line = evaluation_command_line();
  if (!line.parse(arguments)) return 0;
  EvaluationRequest request = evaluation_request_from(line);
  const rosbag::Bag bag = open_bag(request.bag);
  // Where odometry was on /tf, there is no dead reckoning to compare with.
  const bool is_asked_for = request.odom != kUsualOdometry || request.with_batch;
  if (!is_asked_for && !has_topic(bag, request.odom)) request.with_odometry = false;
  require_topics(bag, request);
  if (request.map_options.matching == LandmarkMatching::automatic && are_seen_without_ids(bag)) {
    request.map_options.matching = LandmarkMatching::nearest;
  }
  RecordedRun run = naming(request.bag, [&] { return read_run(bag, request); });
  if (!request.is_quiet && !run.odometry_left_out.empty()) {
    std::printf("%s: %s\n", request.bag.c_str(), run.odometry_left_out.c_str());
  }
  if (is_for_paths_alone(bag, request)) {
    draw_paths_alone(run, request);
    return 0;
  }
  const Evaluation evaluation = naming(request.bag, [&] { return judged(bag, request, &run); });
  if (!request.is_quiet) print(request.bag, evaluation);
  if (request.json) {
    // What a bag or its name says may be of any encoding.
    constexpr auto kReplace = nlohmann::json::error_handler_t::replace;
    write_file(*request.json, to_json(evaluation).dump(2, ' ', false, kReplace) + "\n");
  }
  if (request.plot) plot_paths(picture_of(run, evaluation, request), *request.plot);
  return 0;
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  return pf_resampling::run_tool("evaluate_bag", argc, argv, pf_resampling::evaluate_bag);
}
