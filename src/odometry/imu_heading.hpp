#pragma once

#include <ros/time.h>
#include <sensor_msgs/Imu.h>

#include <optional>
#include <string>

#include "src/frames/static_frames.hpp"
#include "src/messages/rejects.hpp"
#include "src/odometry/odometry_buffer.hpp"

namespace pf_resampling {

/// How far a robot has turned, by its IMU: the heading at the newest message, and a little beyond.
/// Its zero is anywhere, so differences alone count.
class ImuHeading {
 public:
  explicit ImuHeading(ImuUse use = ImuUse::none) : use_(use) {}

  /// Takes a message; `on_robot` has to know where its frame is on `base`, unless it is the same.
  /// Messages are passed over if the use is none, and if they say (covariance -1, REP 145) that
  /// they do not have what is to be used.
  std::optional<Rejection> take(const sensor_msgs::Imu& imu, const std::string& base,
                                const StaticFrames& on_robot);

  /// The heading (rad) at a stamp near the newest message; nothing if that is far, and once after
  /// a silence, in which nobody knows how far the robot turned.
  std::optional<double> at(ros::Time stamp);

  void clear() { *this = ImuHeading(use_); }

 private:
  ImuUse use_;
  ros::Time newest_;  // zero: none yet
  bool was_silent_ = false;
  double heading_ = 0.0;
  double rate_ = 0.0;
};

}  // namespace pf_resampling
