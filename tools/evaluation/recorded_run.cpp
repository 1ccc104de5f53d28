#include "tools/evaluation/recorded_run.hpp"

#include <algorithm>

#include "pf_resampling_core/error.hpp"
#include "tools/common/bag.hpp"

namespace pf_resampling {
namespace {

constexpr const char* kBeaconMap = "/beacon_map";

/// The place on the robot that the truth is about.
Pose2 place_of_truth(const rosbag::Bag& bag, const std::optional<std::string>& wanted) {
  const auto frames = read_frames_on_robot(bag, "base_link");
  const auto found = frames.find(wanted.value_or("ground_truth"));
  if (found != frames.end()) return to_pose2(found->second);
  if (!wanted) return {};
  throw Error("--truth-frame " + *wanted +
              ": /tf_static does not place it on base_link; give one that it does");
}

}  // namespace

RecordedRun read_run(const rosbag::Bag& bag, const EvaluationRequest& request) {
  RecordedRun run;
  run.place = place_of_truth(bag, request.truth_frame);
  run.estimate = path_of_place(read_poses(bag, request.pose), run.place);
  run.beacons = read_beacons(bag, request.beacons);
  run.map = read_landmark_map(bag, kLandmarkMap);
  run.true_map = read_landmark_map(bag, kTrueMap);
  if (request.with_odometry) {
    const RecordedOdometry odometry = read_odometry(bag, request.odom);
    run.dead_reckoning = path_of_place(odometry.poses, run.place);
    run.odometry_left_out = odometry.left_out;
  }
  run.finds_beacons = !run.map.has_value() && has_topic(bag, kBeaconMap);
  if (run.finds_beacons) {
    run.map = read_beacon_map(bag, kBeaconMap);
    run.true_map.emplace();
    for (const Beacon& beacon : run.beacons) {
      PointLandmark landmark;
      landmark.id = beacon.id;
      landmark.position = beacon.position.head<2>();
      run.true_map->push_back(landmark);
    }
  }
  if (const auto path = run.map && !run.finds_beacons ? read_path(bag, kPath) : std::nullopt) {
    run.believed = path_of_place(*path, run.place);
  }
  run.filter = read_filter_summary(bag, kStatus);
  run.has_initial_pose = has_topic(bag, "/initialpose");
  return run;
}

std::vector<TruePose> truth_at(const std::vector<EstimatedPose>& path,
                               const std::vector<TruePose>& truth) {
  const double max_gap = usual_max_gap(truth);
  std::vector<TruePose> there;
  for (const EstimatedPose& pose : path) {
    if (const auto true_pose = interpolate(truth, pose.time, max_gap)) there.push_back(*true_pose);
  }
  return there;
}

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

}  // namespace pf_resampling
