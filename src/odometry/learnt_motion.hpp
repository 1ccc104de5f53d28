#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>

#include "pf_resampling_core/geometry.hpp"
#include "src/odometry/saved_progress.hpp"

namespace pf_resampling {

/// Of a robot, as seen halfway through its turn: m/s ahead and to the left, rad/s.
struct Velocity {
  double forward = 0.0;
  double left = 0.0;
  double turn = 0.0;

  double speed() const { return std::hypot(forward, left); }
  bool is_moving() const { return speed() > 0.02 || std::abs(turn) > 0.02; }
};

/// That of a robot that makes `motion` (in its frame at the start) in `duration`, s, above 0; and
/// back.
Velocity velocity_of(const Pose2& motion, double duration);
Pose2 motion_of(const Velocity& velocity, double duration);
/// Between the first and, at a share of 1, the second.
Velocity mixed(const Velocity& first, const Velocity& second, double share);

/// What a robot can do, learnt from its odometry: by how much its steps differ from those that the
/// velocity before them leads to expect, how long they take, and how fast it gets. A few jumps
/// among them teach nothing.
class LearntMotion {
 public:
  /// A step from one message to the next, whether it is believed or not.
  void add_step(const Pose2& step, double duration, const Velocity& before);
  /// What it was seen to reach.
  void add_velocity(const Velocity& velocity);

  /// Whether it can make a step, having driven at `before`.
  bool allows(const Pose2& step, double duration, const Velocity& before) const;
  /// Whether a step is what a change from `before` to `after` in its midst explains.
  static bool is_between(const Pose2& step, double duration, const Velocity& before,
                         const Velocity& after);
  /// Whether it can get so far, m, in so long, s, whatever it did before; true while little has
  /// been seen of it.
  bool reaches(double distance, double duration) const;
  /// Whether the newest velocity is one that wheels show when they slip: well above whatever the
  /// robot has driven at, from one moment to the next, and not for long.
  bool may_slip() const { return speed_.slipping > 0.0; }

  /// What it takes to notice slips; goes on from there.
  const DrivenSpeed& speed() const { return speed_; }
  void resume(const DrivenSpeed& speed);

 private:
  struct Step {
    double duration = 0.0;   // s
    double departure = 0.0;  // m, from what was expected
  };
  bool is_known() const;
  double usual_departure() const;
  double usual_duration() const;

  std::deque<Step> steps_;  // the latest
  Velocity top_;            // magnitudes
  DrivenSpeed speed_;
};

}  // namespace pf_resampling
