#pragma once

#include <optional>
#include <string>

#include "pf_resampling_core/evaluation/map_errors.hpp"
#include "pf_resampling_core/evaluation/path_errors.hpp"
#include "tools/common/command_line.hpp"

namespace pf_resampling {

/// Where odometry is looked for if nothing else is said.
inline constexpr const char* kUsualOdometry = "/odom";
/// What filters give out, and the true map.
inline constexpr const char *kStatus = "/status", *kPath = "/path", *kLandmarkMap = "/landmark_map",
                            *kTrueMap = "/ground_truth_landmarks";

/// Of evaluate_bag.
CommandLine evaluation_command_line();

/// What the command line asks for.
struct EvaluationRequest {
  std::string bag;
  PathErrorOptions path_options;
  MapErrorOptions map_options;
  std::string frame;  ///< "auto", "given", "start", "fit"
  bool with_odometry = true;
  bool with_batch = false;
  bool with_online = false;
  bool is_quiet = false;
  std::optional<std::string> truth_frame, json, plot;
  std::string truth, pose, odom, beacons, landmarks, ranges;  ///< topics
};

/// Throws UsageError: an option has a value that makes no sense, alone or beside others.
EvaluationRequest evaluation_request_from(const CommandLine& line);

}  // namespace pf_resampling
