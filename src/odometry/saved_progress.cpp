#include "src/odometry/saved_progress.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace pf_resampling {
namespace {

constexpr std::int64_t kNanoseconds = 1000000000;  // in a second
constexpr std::int64_t kLatest = 0x7fffffff;       // s, that ROS 1 can reckon with

bool is_in_reach(const std::optional<Eigen::Matrix3d>& covariance) {
  return !covariance || (covariance->array().abs() <= kFarthestPosition * kFarthestPosition).all();
}

}  // namespace

std::string fault_of(const SavedProgress& progress) {
  if (progress.odometry.empty()) return "there is no odometry";
  std::int64_t previous = -1;
  if (!is_in_reach(progress.odometry_offset)) return "the offset of the odometry is beyond 1e9 m";
  for (const SavedOdometry& odometry : progress.odometry) {
    if (!is_in_reach(odometry.received) || !is_in_reach(odometry.pose)) {
      return "a pose of the odometry is beyond 1e9 m";
    }
    if (!is_in_reach(odometry.covariance) || !is_in_reach(odometry.step_covariance)) {
      return "a covariance of the odometry is beyond 1e18";
    }
    if (odometry.stamp <= previous) return "the stamps of the odometry do not ascend";
    previous = odometry.stamp;
  }
  const std::int64_t latest =
      std::max({previous, progress.first_odometry, progress.last_observation});
  if (latest / kNanoseconds > kLatest) return "a stamp is too large for ROS 1";
  if (progress.used < progress.odometry.front().stamp || progress.used > previous) {
    return "the odometry does not reach back to what the filter has used";
  }
  if (progress.first_odometry < 0 || progress.last_observation < 0) return "a stamp is negative";
  if (!(progress.lost_probability >= 0.0 && progress.lost_probability <= 1.0)) {
    return "the probability of being lost is not in [0, 1]";
  }
  if (!(progress.normalized_innovation >= 0.0 && std::isfinite(progress.normalized_innovation))) {
    return "the mean innovation is negative or not finite";
  }
  return {};
}

void describe(Archive& archive, SavedOdometry& odometry) {
  archive("stamp", odometry.stamp);
  archive("received", odometry.received);
  archive("pose", odometry.pose);
  archive("covariance", odometry.covariance);
  archive("step_covariance", odometry.step_covariance);
  archive("may_slip", odometry.may_slip);
}

void describe(Archive& archive, SavedProgress& progress) {
  archive("first_odometry", progress.first_odometry);
  archive("used", progress.used);
  archive("last_observation", progress.last_observation);
  archive("lost_probability", progress.lost_probability);
  archive("normalized_innovation", progress.normalized_innovation);
  archive("odometry_offset", progress.odometry_offset);
  archive("driven", progress.driven);
  archive("slipping", progress.slipping);
  archive("moving", progress.moving);
  archive("moves", progress.moves);
  archive("odometry", progress.odometry);
}

}  // namespace pf_resampling
