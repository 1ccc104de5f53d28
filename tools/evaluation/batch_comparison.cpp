#include "tools/evaluation/batch_comparison.hpp"

#include <optional>
#include <string>
#include <vector>

#include "pf_resampling_core/evaluation/map_errors.hpp"
#include "pf_resampling_core/evaluation/path_errors.hpp"
#include "pf_resampling_core/range_memory/radio_remark.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/bag_contents.hpp"
#include "tools/common/batch_slam.hpp"
#include "tools/common/filter_associations.hpp"
#include "tools/common/range_drive.hpp"

namespace pf_resampling {
namespace {

Recording recording_of(const rosbag::Bag& bag, const EvaluationRequest& request) {
  return read_recording(bag, request.odom, request.ranges, request.landmarks);
}

/// Where no observation has an id: those of the landmarks that it is of by the filter's last path
/// and map. False if there are ids, or no such path and map.
bool take_ids_of_filter(const rosbag::Bag& bag, Recording* recording) {
  for (const StampedScan& scan : recording->scans) {
    for (const SeenLandmark& seen : scan.landmarks) {
      if (seen.id >= 0) return false;
    }
  }
  const auto path = read_path(bag, kPath);
  const auto map = read_landmark_map(bag, kLandmarkMap);
  if (!path || path->empty() || !map || map->empty()) return false;
  recording->scans = associated_by({*path, *map}, *recording);
  return true;
}

/// Brings a solution, which begins at its origin, to the truth's frame as the estimate was.
FrameChoice frame_of_solution(const std::vector<EstimatedPose>& path,
                              const std::string& frame_of_estimate, const RecordedRun& run,
                              const PathErrorOptions& options) {
  return choose_frame(frame_of_estimate == "given" ? "start" : frame_of_estimate, true, run.truth,
                      path, options);
}

/// The errors of the solution, found in the same way as those of the estimate.
BatchComparison judge_batch(const BatchSolution& solution, bool has_ids_of_filter,
                            const std::string& frame_of_estimate, const RecordedRun& run,
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
                         const Pose2& alignment, const RecordedRun& run,
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

BatchComparison compare_with_landmarks(const rosbag::Bag& bag, const RecordedRun& run,
                                       const EvaluationRequest& request,
                                       const Evaluation& evaluation) {
  Recording recording = recording_of(bag, request);
  const bool has_ids_of_filter = take_ids_of_filter(bag, &recording);
  BatchSolution solution = solve_batch(recording);
  solution.path = path_of_place(solution.path, run.place);
  BatchComparison batch =
      judge_batch(solution, has_ids_of_filter, evaluation.frame, run, request.path_options);
  if (evaluation.path_aligned) {
    batch.path_aligned = evaluate_aligned_path(truth_at(*run.believed, run.truth), solution.path,
                                               request.path_options);
  }
  add_ratios(evaluation, &batch);
  if (request.with_online) {
    const OnlineSolution online = solve_online(recording);
    const std::vector<EstimatedPose> path = path_of_place(online.path, run.place);
    const FrameChoice frame = frame_of_solution(path, evaluation.frame, run, request.path_options);
    batch.online =
        judge_online(online, path, frame.alignment, run, request.path_options, evaluation);
  }
  return batch;
}

/// The beacons' frame is the truth's.
BatchComparison compare_with_ranges(const rosbag::Bag& bag, const RecordedRun& run,
                                    const EvaluationRequest& request,
                                    const Evaluation& evaluation) {
  const PathErrorOptions& options = request.path_options;
  Recording drive = recording_of(bag, request);
  drive.beacons = run.beacons;
  const RangeSolution solution = solve_ranges(drive);
  const RangeMemory& memory = solution.memory;
  const std::vector<EstimatedPose> path = path_of_place(solution.path, run.place);
  const Eigen::VectorXd newest = memory.newest(memory.modes().front()).mean;
  const auto constant = [&](CommonUnknown::Index of) {
    return newest[KeyframeUnknown::count + of];
  };
  BatchComparison batch;
  batch.errors = evaluate_path(run.truth, path, options);
  batch.aligned = evaluate_aligned_path(run.truth, path, options);
  batch.distance_scale = 1.0 + constant(CommonUnknown::distance_scale);
  batch.yaw_scale = 1.0 + constant(CommonUnknown::turn_scale);
  batch.observations = solution.ranges;
  batch.outliers = solution.outliers;
  RadioComparison& found = batch.radios.emplace();
  found.noise = memory.noise();
  found.yaw_rate_bias = newest[KeyframeUnknown::yaw_rate_bias];
  for (const RadioKnowledge& radio : memory.radios()) {
    if (radio.ranges > 0) found.radios.push_back(radio);
    const std::string remark = remark_on(radio, run.beacons);
    if (!remark.empty()) found.remarks.push_back(remark);
  }
  add_ratios(evaluation, &batch);
  if (request.with_online) {
    batch.online = judge_online(solution.online, path_of_place(solution.online.path, run.place),
                                Pose2{}, run, options, evaluation);
  }
  return batch;
}

}  // namespace

bool is_of_ranges(const rosbag::Bag& bag, const EvaluationRequest& request) {
  return !has_topic(bag, request.landmarks) && has_topic(bag, request.ranges);
}

BatchComparison compare_with_batch(const rosbag::Bag& bag, const RecordedRun& run,
                                   const EvaluationRequest& request, const Evaluation& evaluation) {
  return is_of_ranges(bag, request) ? compare_with_ranges(bag, run, request, evaluation)
                                    : compare_with_landmarks(bag, run, request, evaluation);
}

}  // namespace pf_resampling
