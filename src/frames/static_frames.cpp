#include "src/frames/static_frames.hpp"

#include <cmath>

#include "src/messages/conversions.hpp"

namespace pf_resampling {
namespace {

constexpr double kFarthest = 1e6;  // m; no robot is that large
// Joints between a robot and its sensor: more than there are of any. Also what ends a circle.
constexpr int kLongestChain = 50;

}  // namespace

bool StaticFrames::add(const geometry_msgs::TransformStamped& transform) {
  const std::string parent = without_slash(transform.header.frame_id);
  const std::string child = without_slash(transform.child_frame_id);
  const auto& t = transform.transform.translation;
  const auto& q = transform.transform.rotation;
  if (parent == child || parent.empty() || child.empty()) return false;
  const double distance = std::hypot(t.x, t.y, t.z);
  if (!(distance <= kFarthest) || !is_unit(q)) return false;
  parents_[child] = {parent, Eigen::Translation3d(t.x, t.y, t.z) *
                                 Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized()};
  return true;
}

void StaticFrames::add(const std::string& parent, const std::string& frame,
                       const Eigen::Vector3d& place, double yaw) {
  parents_[without_slash(frame)] = {
      without_slash(parent),
      Eigen::Translation3d(place) * Eigen::AngleAxisd(yaw, Eigen::Vector3d(0.0, 0.0, 1.0))};
}

std::optional<Eigen::Isometry3d> StaticFrames::pose(const std::string& base,
                                                    const std::string& frame) const {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  std::string current = frame;
  for (int step = 0; step <= kLongestChain; ++step) {
    if (current == base) return pose;
    const auto parent = parents_.find(current);
    if (parent == parents_.end()) return std::nullopt;
    pose = parent->second.pose * pose;
    current = parent->second.frame;
  }
  return std::nullopt;
}

}  // namespace pf_resampling
