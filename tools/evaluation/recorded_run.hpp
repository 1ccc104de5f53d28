#pragma once

#include <rosbag/bag.h>

#include <optional>
#include <string>
#include <vector>

#include "pf_resampling_core/evaluation/path_errors.hpp"
#include "tools/common/bag_contents.hpp"
#include "tools/common/evaluation_report.hpp"
#include "tools/common/recording.hpp"
#include "tools/evaluation/evaluation_request.hpp"

namespace pf_resampling {

/// What the bag holds of a run.
struct RecordedRun {
  Pose2 place;                                ///< on the robot, of truth and paths
  std::vector<TruePose> truth;                ///< while there is odometry
  std::vector<EstimatedPose> estimate;        ///< of the place, as all paths are
  std::vector<EstimatedPose> dead_reckoning;  ///< empty if it is not asked for
  std::string odometry_left_out;              ///< of the odometry; empty: nothing
  /// The whole path at the end, if there is a map.
  std::optional<std::vector<EstimatedPose>> believed;
  std::vector<Beacon> beacons;
  std::optional<std::vector<PointLandmark>> map, true_map;
  bool finds_beacons = false;  ///< which are the map
  bool has_initial_pose = false;
  std::optional<FilterSummary> filter;
};

/// All but the truth. Throws Error: the bag holds what makes no sense, or lacks a frame.
RecordedRun read_run(const rosbag::Bag& bag, const EvaluationRequest& request);

/// The truth at the stamps of a path; not inside its gaps.
std::vector<TruePose> truth_at(const std::vector<EstimatedPose>& path,
                               const std::vector<TruePose>& truth);

/// Brings the filter's frame to the truth's. A map that was begun at nothing has a frame of its
/// own, and only its start, or a fit, can tell where that lies.
struct FrameChoice {
  std::string frame = "given";  ///< "given", "start", "fit"
  Pose2 alignment;
};

/// `wanted` is one of these or "auto"; `is_own`: the estimate is of a frame of its own.
FrameChoice choose_frame(const std::string& wanted, bool is_own, const std::vector<TruePose>& truth,
                         const std::vector<EstimatedPose>& estimate,
                         const PathErrorOptions& options);

}  // namespace pf_resampling
