#include "pf_resampling_core/simulation/driving.hpp"

#include <algorithm>
#include <cmath>

namespace pf_resampling {

Pose2 arc_motion(double speed, double lateral_speed, double yaw_rate, double duration) {
  const double angle = yaw_rate * duration;
  // Integrals of the cosine and the sine of the heading over the angle turned, divided by it;
  // series where the quotients lose their digits.
  double along = 1.0 - angle * angle / 6.0;
  double across = angle / 2.0;
  if (std::abs(angle) > 1e-4) {
    along = std::sin(angle) / angle;
    across = (1.0 - std::cos(angle)) / angle;
  }
  return {duration * (along * speed - across * lateral_speed),
          duration * (across * speed + along * lateral_speed), wrap_angle(angle)};
}

Control steer(const DriveOptions& options, const Pose2& pose, const Eigen::Vector2d& target) {
  const double bearing = std::atan2(target.y() - pose.y, target.x() - pose.x);
  const double error = wrap_angle(bearing - pose.heading);
  const double limit = options.yaw_rate_limit;
  return {options.speed * std::max(options.speed_floor, std::cos(error)),
          std::clamp(options.yaw_rate_gain * error, -limit, limit)};
}

Driver::Driver(const World& world) : world_(world) {}

Control Driver::next_control(const Pose2& pose) {
  const int count = static_cast<int>(world_.waypoints.size());
  const auto waypoint = [&] { return world_.waypoints[static_cast<std::size_t>(target_ % count)]; };
  const Eigen::Vector2d current = waypoint();
  if (std::hypot(current.x() - pose.x, current.y() - pose.y) < world_.drive.reached_distance) {
    if (!world_.repeat && target_ + 1 == count) {
      finished_ = true;
      return {};
    }
    ++target_;
  }
  return steer(world_.drive, pose, waypoint());
}

}  // namespace pf_resampling
