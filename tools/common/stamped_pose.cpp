#include "tools/common/stamped_pose.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {

void check_path(const std::vector<StampedPose>& path, const char* name) {
  if (path.empty()) throw Error(std::string(name) + " is empty: it needs at least one pose");
  for (std::size_t i = 0; i < path.size(); ++i) {
    const auto& [time, pose] = path[i];
    const std::string which = std::string(name) + ": pose " + std::to_string(i + 1) + " of " +
                              std::to_string(path.size());
    if (!std::isfinite(time + pose.x + pose.y + pose.heading)) {
      throw Error(which + " is not finite (time " + std::to_string(time) + " s)");
    }
    if (i > 0 && time < path[i - 1].time) {
      throw Error(which + " goes back in time, from " + std::to_string(path[i - 1].time) + " to " +
                  std::to_string(time) + " s: sort the poses by their stamps");
    }
  }
}

Pose2 pose_at(const std::vector<StampedPose>& path, double time) {
  const auto after =
      std::upper_bound(path.begin(), path.end(), time,
                       [](double value, const StampedPose& pose) { return value < pose.time; });
  if (after == path.begin()) return path.front().pose;
  const StampedPose& before = *(after - 1);
  if (after == path.end() || before.time == time) return before.pose;
  const double share = (time - before.time) / (after->time - before.time);
  const Pose2 &from = before.pose, &to = after->pose;
  return {from.x + share * (to.x - from.x), from.y + share * (to.y - from.y),
          wrap_angle(from.heading + share * wrap_angle(to.heading - from.heading))};
}

}  // namespace pf_resampling
