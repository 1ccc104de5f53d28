#pragma once

#include <functional>
#include <vector>

#include "pf_resampling_core/smoothing/smoother.hpp"
#include "tools/common/stamped_pose.hpp"

namespace pf_resampling {

/// The odometry between two times, with covariance and sensitivities.
using OdometryBetween = std::function<MotionFactor(double from, double to)>;

/// Throws Error for a drive of more poses than memory can be expected to hold: one at each of these
/// times (s, ascending, of the odometry, which is a path) and at its end, and in between at least
/// every half second, whether or not there is odometry.
void check_size(const std::vector<StampedPose>& odometry, const std::vector<double>& times);

/// A drive up to a time: the poses of a graph, with their times, joined by odometry. What was
/// observed from them is the caller's to add.
class BatchDrive {
 public:
  /// Begins at the prior's pose, at the first stamp of the odometry (in a frame of its own).
  /// `robust_width`: of the loss of what is observed, in standard deviations. Throws Error for
  /// odometry that is no path or has no duration.
  BatchDrive(const std::vector<StampedPose>& odometry, OdometryBetween motion_between,
             GaussianPrior prior, double robust_width);

  /// From the estimate as it is.
  SmoothingResult solve();
  /// With the loss at once, and with one that is narrowed to it; the better.
  SmoothingResult solve_both_ways();

  /// Poses up to `time`, by odometry as it is now believed; none is far from the next.
  void drive_to(double time);

  /// The newest pose, brought to a time after it by odometry.
  StampedPose newest_at(double time) const;

  /// At each of these stamps: from the pose before by odometry, and what is then missing to the
  /// pose after, in proportion to the time.
  std::vector<StampedPose> path_at(const std::vector<StampedPose>& stamps) const;

  int newest() const { return static_cast<int>(graph.poses.size()) - 1; }

  SmoothingGraph graph;
  std::vector<double> times;  ///< of the poses, s

 private:
  OdometryBetween motion_between_;
  double robust_width_;
};

struct OnlineSolution {
  std::vector<StampedPose> path;  ///< at the stamps of the odometry
  int solutions = 0;
  int refused = 0;  ///< of these; the estimate stayed as the odometry had it
};

/// What least squares says while the robot drives. `observe` adds what was observed at the i-th of
/// these times, ascending, to the newest pose; `is_surprising`: whether the newest observations are
/// far from the solution, which then is looked for both ways.
OnlineSolution solve_along(const std::vector<StampedPose>& odometry,
                           const std::vector<double>& times,
                           const std::function<void(std::size_t)>& observe,
                           const std::function<bool()>& is_surprising, BatchDrive* drive);

}  // namespace pf_resampling
