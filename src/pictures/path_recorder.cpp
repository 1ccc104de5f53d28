#include "src/pictures/path_recorder.hpp"

#include <cmath>

#include "src/messages/conversions.hpp"

namespace pf_resampling {
namespace {

// rad: without a pose in each turn, the path through a room of a few metres cuts its corners.
constexpr double kTurn = 0.3;

}  // namespace

void PathRecorder::clear() {
  spacing_ = start_spacing_;
  path_.poses.clear();
}

void PathRecorder::add(ros::Time stamp, const std::string& frame, const Pose2& pose) {
  path_.header.stamp = stamp;
  path_.header.frame_id = frame;
  const bool is_near = std::hypot(pose.x - last_.x, pose.y - last_.y) < spacing_;
  const bool is_straight = std::abs(wrap_angle(pose.heading - last_.heading)) < kTurn;
  if (!path_.poses.empty() && is_near && is_straight) return;
  last_ = pose;
  geometry_msgs::PoseStamped stamped;
  stamped.header = path_.header;
  stamped.pose = to_pose_message(pose);
  path_.poses.push_back(stamped);
  if (static_cast<int>(path_.poses.size()) <= length_) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < path_.poses.size(); i += 2) path_.poses[kept++] = path_.poses[i];
  path_.poses.resize(kept);
  spacing_ = spacing_ > 0.0 ? 2.0 * spacing_ : 0.01;
}

}  // namespace pf_resampling
