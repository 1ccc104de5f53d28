#include "pf_resampling/static_frames.hpp"

#include <cmath>

#include "pf_resampling/conversions.hpp"

namespace pf_resampling {

bool StaticFrames::add(const geometry_msgs::TransformStamped& transform) {
  const std::string parent = without_slash(transform.header.frame_id);
  const std::string child = without_slash(transform.child_frame_id);
  const auto& t = transform.transform.translation;
  const auto& q = transform.transform.rotation;
  if (parent == child || parent.empty() || child.empty()) return false;
  if (!std::isfinite(t.x) || !std::isfinite(t.y) || !std::isfinite(t.z) || !is_unit(q)) {
    return false;
  }
  Parent& entry = parents_[child];
  entry.frame = parent;
  entry.pose =
      Eigen::Translation3d(t.x, t.y, t.z) * Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized();
  return true;
}

void StaticFrames::add(const std::string& parent, const std::string& frame,
                       const Eigen::Vector3d& place) {
  Parent& entry = parents_[without_slash(frame)];
  entry.frame = without_slash(parent);
  entry.pose = Eigen::Isometry3d(Eigen::Translation3d(place));
}

std::optional<Eigen::Vector3d> StaticFrames::origin(const std::string& base,
                                                    const std::string& frame) const {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  std::string current = frame;
  // A chain longer than there are frames goes in a circle.
  for (std::size_t step = 0; step <= parents_.size(); ++step) {
    if (current == base) return place;
    const auto parent = parents_.find(current);
    if (parent == parents_.end()) return std::nullopt;
    place = parent->second.pose * place;
    current = parent->second.frame;
  }
  return std::nullopt;
}

}  // namespace pf_resampling
