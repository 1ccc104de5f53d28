#pragma once

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>

#include <optional>
#include <sstream>
#include <string>

#include "src/frames/frame_names.hpp"
#include "src/messages/rejects.hpp"
#include "src/odometry/odometry_buffer.hpp"

namespace pf_resampling {

/// A rejection whose detail is made of `parts` as streams print them.
template <typename... Parts>
Rejection rejection(RejectReason reason, const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  return {reason, text.str()};
}

/// Whether `given`, called `what`, is the frame `expected`, which `parameter` sets.
std::optional<Rejection> check_frame(const std::string& what, const std::string& given,
                                     const std::string& expected, const std::string& parameter);

/// Whether times can be reckoned with a stamp.
std::optional<Rejection> check(const ros::Time& stamp);

/// What can be told of a message by itself. Nothing: it can be used.
std::optional<Rejection> check(const nav_msgs::Odometry& odometry, const FrameNames& frames);
std::optional<Rejection> check(const geometry_msgs::PoseWithCovarianceStamped& pose,
                               const FrameNames& frames);

/// A checked odometry message for the buffer; with its covariance if that is one of planar motion.
StampedOdometry to_stamped_odometry(const nav_msgs::Odometry& odometry);

/// "0.120 s".
std::string seconds_text(double seconds);

}  // namespace pf_resampling
