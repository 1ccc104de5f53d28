#pragma once

#include <geometry_msgs/TransformStamped.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <string>

namespace pf_resampling {

/// Where sensors sit on the robot, from /tf_static, /tf or the configuration. The newest transform
/// of a frame counts: sensors are fixed to the robot.
class StaticFrames {
 public:
  /// Takes note of a transform. Returns false, and ignores it, if it is not a rigid motion of
  /// at most 1e6 m between two different frames.
  bool add(const geometry_msgs::TransformStamped& transform);

  /// A frame at `place` (m) in the frame `parent`, turned by `yaw` (rad) about its z axis.
  void add(const std::string& parent, const std::string& frame, const Eigen::Vector3d& place,
           double yaw = 0.0);

  /// The frame `frame` in the frame `base` (m). Nothing if they are not connected going up from
  /// `frame` to `base`, by 50 steps at most.
  std::optional<Eigen::Isometry3d> pose(const std::string& base, const std::string& frame) const;

 private:
  struct Parent {
    std::string frame;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  };
  std::map<std::string, Parent> parents_;
};

}  // namespace pf_resampling
