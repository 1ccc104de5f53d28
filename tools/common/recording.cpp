#include "tools/common/recording.hpp"

#include <algorithm>

namespace pf_resampling {

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
