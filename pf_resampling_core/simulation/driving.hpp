#pragma once

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/simulation/world.hpp"

namespace pf_resampling {

/// What the robot is told to do during one control period.
struct Control {
  double speed = 0.0;     ///< m/s
  double yaw_rate = 0.0;  ///< rad/s
};

/// The pose after `duration` seconds of constant speed, sideways speed and yaw rate, seen from the
/// pose at the start: an arc, in closed form.
Pose2 arc_motion(double speed, double lateral_speed, double yaw_rate, double duration);

/// Steers towards `target`: the speed is slowed by the cosine of the heading error, with a floor;
/// the yaw rate is proportional to that error, with a limit.
Control steer(const DriveOptions& options, const Pose2& pose, const Eigen::Vector2d& target);

/// Drives along the way-points of a world, one control period after the other, without noise.
class Driver {
 public:
  explicit Driver(const World& world);

  /// Takes the next way-point if the current one is close enough, then steers. Once the last one is
  /// reached and the world does not repeat, the control is zero and `finished()` true.
  Control next_control(const Pose2& pose);

  /// How many way-points were targets so far, minus one: goes on counting over laps.
  int target() const { return target_; }
  bool finished() const { return finished_; }

 private:
  const World& world_;
  int target_ = 0;
  bool finished_ = false;
};

}  // namespace pf_resampling
