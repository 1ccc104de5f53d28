#pragma once

#include <vector>

#include "tools/common/recording.hpp"

namespace pf_resampling {

struct OnlineSolution {
  std::vector<StampedPose> path;  ///< at the stamps of the odometry
  int solutions = 0;
  int refused = 0;  ///< of these; the estimate stayed as the odometry had it
};

/// Standard deviations that least squares weighs its data by where the data state none: a wheeled
/// robot, and a camera that measures distances by the size of what it sees (MRCLAM).
struct BatchNoise {
  double range = 0.04;          ///< m, at no distance
  double range_share = 0.03;    ///< of the range, added
  double bearing = 0.015;       ///< rad
  double along = 0.03;          ///< m per sqrt(m) driven, ahead
  double across = 0.015;        ///< m per sqrt(m) driven, to the side
  double standing = 0.002;      ///< m per sqrt(s), besides
  double heading = 0.035;       ///< rad per sqrt(s)
  double distance_scale = 0.1;  ///< prior of true over measured distance, about 1
  double yaw_scale = 0.1;       ///< prior of true over measured turn, about 1
};

struct BatchSolution {
  std::vector<StampedPose> path;  ///< at the stamps of the odometry; the first is the origin
  std::vector<PointLandmark> landmarks;
  double distance_scale = 1.0;  ///< measured over true
  double yaw_scale = 1.0;
  int observations = 0;  ///< that took part
  int outliers = 0;      ///< of these, farther off than 4 standard deviations
};

/// The path, map and scales of the odometry that fit all data best at once: one smoothing problem
/// with a robust loss for misread ids; landmarks without one are left out. No filter can do better
/// on the same model, as it knows the past only. Throws Error if there is no solution, no landmark
/// with an id, no odometry, or more of poses or landmarks than memory can be expected to hold.
BatchSolution solve_batch(const Recording& recording, const BatchNoise& noise = {});

/// What can be known while the robot drives, on the same model: solved anew after every scan with
/// landmarks, from the last solution on, with all data up to then. The path is that of the newest
/// poses: of each solution the newest, and from there by odometry until the next; its first pose is
/// the origin. Takes a time that grows with the square of the drive's. Throws Error as
/// solve_batch() does.
OnlineSolution solve_online(const Recording& recording, const BatchNoise& noise = {});

}  // namespace pf_resampling
