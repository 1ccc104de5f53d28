#pragma once

#include <algorithm>
#include <boost/make_shared.hpp>
#include <cmath>
#include <string>
#include <variant>
#include <vector>

#include "src/messages/conversions.hpp"
#include "test/pipeline_outputs.hpp"

namespace pf_resampling {

/// m. What is driven and seen is exact: a filter that is right is seldom off by 0.1 m. Five times
/// that is lost.
inline constexpr double kLost = 0.5;

inline double distance(const Pose2& a, const Pose2& b) {
  return std::hypot(a.x - b.x, a.y - b.y);
}

/// As one gives it by hand, as sure in x, y and heading (m^2, rad^2).
inline geometry_msgs::PoseWithCovarianceStamped initial_pose(ros::Time stamp, const Pose2& pose,
                                                             double variance = 0.01) {
  geometry_msgs::PoseWithCovarianceStamped start;
  start.header.frame_id = "map";
  start.header.stamp = stamp;
  start.pose.pose = to_pose_message(pose);
  start.pose.covariance = to_covariance_message(variance * Eigen::Matrix3d::Identity());
  return start;
}

/// A drive whose messages of one type are as `change` makes them, one after the other.
template <typename Changed, typename Message, typename Change>
std::vector<Message> changed(std::vector<Message> messages, const Change& change) {
  for (Message& message : messages) {
    const auto* const as_it_was = std::get_if<typename Changed::ConstPtr>(&message);
    if (as_it_was == nullptr) continue;
    const auto copy = boost::make_shared<Changed>(**as_it_was);
    change(copy.get());
    message = typename Changed::ConstPtr(copy);
  }
  return messages;
}

/// As a gyro with the wrong sign makes the path that the odometry tells.
inline void mirror(nav_msgs::Odometry* odometry) {
  odometry->pose.pose.position.y *= -1.0;
  odometry->pose.pose.orientation.z *= -1.0;
}

/// As wheels count that are 4 % smaller than told.
inline void lengthen(nav_msgs::Odometry* odometry) {
  odometry->pose.pose.position.x *= 1.04;
  odometry->pose.pose.position.y *= 1.04;
}

/// The options of a drive, for a filter that redraws.
template <typename Drive>
auto options_of_redraw() {
  auto options = Drive::options();
  options.filter.strategy.renewal = Renewal::redraw;
  return options;
}

/// A pipeline of either filter on a drive, with all that it gives out. What `sinks_into(&out)`
/// makes connects them.
template <typename PipelineType, typename DriveType, typename OutputsType, typename MessageType>
struct PipelineRig {
  using Drive = DriveType;
  using Message = MessageType;
  using Observation = typename PipelineType::Message;
  using Pipeline = PipelineType;
  using AnyOutputs = OutputsType;

  explicit PipelineRig(const typename PipelineType::Options& options = Drive::options())
      : pipeline(options, sinks_into(&out)) {}

  void feed(const std::vector<Message>& messages) {
    for (const Message& message : messages) handle(message, &pipeline);
  }

  Pose2 pose() const { return to_pose2(out.poses.back().pose.pose); }
  double error() const { return distance(pose(), Drive::truth(out.poses.back().header.stamp)); }
  bool has_said(const std::string& words) const {
    return std::any_of(out.log.begin(), out.log.end(), [&](const std::string& line) {
      return line.find(words) != std::string::npos;
    });
  }
  std::uint64_t rejected(const std::string& input, RejectReason reason) const {
    return pipeline.rejects().count(input, reason);
  }
  static bool is_odometry(const Message& message) {
    return std::holds_alternative<nav_msgs::Odometry::ConstPtr>(message);
  }
  static bool is_observation(const Message& message) {
    return std::holds_alternative<typename Observation::ConstPtr>(message);
  }

  OutputsType out;
  PipelineType pipeline;
};

}  // namespace pf_resampling
