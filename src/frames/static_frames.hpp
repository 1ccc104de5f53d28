#pragma once

#include <geometry_msgs/TransformStamped.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace pf_resampling {

/// Where sensors sit on the robot, from /tf_static, /tf or the configuration. The newest transform
/// of a frame counts: sensors are fixed to the robot.
class StaticFrames {
 public:
  /// No robot has as many; whoever sends one name after the other must not take all of the memory.
  /// When there are more, the half that was neither sent nor asked for lately is forgotten, so a
  /// sensor that is used stays.
  static constexpr std::size_t kMost = 10000;

  /// Takes note of a transform. Returns false, and ignores it, if it is not a rigid motion of
  /// at most 1e6 m between two different frames, with names of at most kLongestFrameName.
  bool add(const geometry_msgs::TransformStamped& transform);

  /// A frame at `place` (m) in the frame `parent`, turned by `yaw` (rad) about its z axis. Returns
  /// false, and ignores it, if a name is too long.
  bool add(const std::string& parent, const std::string& frame, const Eigen::Vector3d& place,
           double yaw = 0.0);

  /// Place of the origin of `frame` in the frame `base` (m). Nothing if they are not connected
  /// going up from `frame` to `base`, by 50 steps at most.
  std::optional<Eigen::Vector3d> origin(const std::string& base, const std::string& frame) const;

  /// The frame `frame` in the frame `base`, likewise.
  std::optional<Eigen::Isometry3d> pose(const std::string& base, const std::string& frame) const;

  /// How many were forgotten so far.
  std::size_t forgotten() const { return forgotten_; }

 private:
  struct Parent {
    std::string frame;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    mutable std::uint64_t used = 0;  // when it was sent or asked for last; counts these
  };
  void put(const std::string& child, const std::string& parent, const Eigen::Isometry3d& pose);

  std::map<std::string, Parent> parents_;
  mutable std::uint64_t now_ = 0;
  std::size_t forgotten_ = 0;
};

}  // namespace pf_resampling
