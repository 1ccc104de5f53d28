#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/models/beacon_range.hpp"
#include "pf_resampling_core/models/landmark_observation.hpp"

namespace pf_resampling {

/// Where the robot was at a time, or is believed to have been.
struct StampedPose {
  double time = 0.0;  ///< s
  Pose2 pose;
};

/// Ranges of the same moment.
struct StampedRanges {
  double time = 0.0;  ///< s
  std::vector<RangeObservation> ranges;
};

struct PointLandmark {
  std::int32_t id = -1;
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  ///< m, map frame
};

/// The landmarks of one scan.
struct StampedScan {
  double time = 0.0;  ///< s
  Pose2 sensor;       ///< on the robot
  std::vector<RangeBearingObservation> landmarks;
};

/// What a filter takes of a drive. Times in s, on one clock; each list in order of time, of finite
/// numbers; what was observed, while there is odometry.
struct Recording {
  std::vector<StampedPose> odometry;  ///< in a frame of its own
  /// Its white noise, if that is stated: standard deviations ahead and to the side, m per sqrt(s),
  /// and in heading, rad per sqrt(s).
  std::optional<Eigen::Vector3d> odometry_noise;
  std::vector<StampedRanges> ranges;
  std::vector<Beacon> beacons;     ///< whose place is known; map frame
  std::vector<StampedScan> scans;  ///< of landmarks; ids of -1 are unknown
};

/// A path at a time: between two poses the position is linear, the heading on the shorter arc;
/// before and after it the pose stays as it is there.
Pose2 pose_at(const std::vector<StampedPose>& path, double time);

}  // namespace pf_resampling
