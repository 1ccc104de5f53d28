#pragma once

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>
#include <pf_resampling/BeaconRange.h>
#include <pf_resampling/LandmarkObservationArray.h>
#include <topic_tools/shape_shifter.h>

#include <string>
#include <type_traits>
#include <variant>

#include "pf_resampling_core/error.hpp"
#include "src/messages/conversions.hpp"
#include "src/messages/foreign_messages.hpp"
#include "src/pipeline/inputs.hpp"

namespace pf_resampling {

/// Whether messages of other types are taken on the topics of an input.
template <typename Message>
constexpr bool kTakesOtherTypes =
    std::is_same_v<Message, nav_msgs::Odometry> || std::is_same_v<Message, BeaconRange> ||
    std::is_same_v<Message, LandmarkObservationArray>;

/// The message if it is of this type; null if not.
template <typename Message>
typename Message::ConstPtr message_in(const topic_tools::ShapeShifter& message) {
  if (message.getDataType() != ros::message_traits::DataType<Message>::value()) return nullptr;
  if (message.getMD5Sum() != ros::message_traits::MD5Sum<Message>::value()) {
    throw Error("it is a " + message.getDataType() + " of another version");
  }
  return message.instantiate<Message>();
}

/// Odometry; or a pose in the odometry frame of the robot, whose frame is `base`.
template <typename Pipeline>
void hand_over_any(const Input<nav_msgs::Odometry>& /*input*/,
                   const topic_tools::ShapeShifter& message, const std::string& base,
                   Pipeline* pipeline) {
  using Pose = geometry_msgs::PoseWithCovarianceStamped;
  if (const auto odometry = message_in<nav_msgs::Odometry>(message)) {
    pipeline->handle(*odometry);
  } else if (const auto pose = message_in<Pose>(message)) {
    pipeline->handle(to_odometry_message(*pose, base));
  } else {
    throw Error("odometry comes as " + message.getDataType() +
                "; nav_msgs/Odometry or geometry_msgs/PoseWithCovarianceStamped is needed");
  }
}

template <typename Pipeline>
void hand_over_any(const Input<LandmarkObservationArray>& /*input*/,
                   const topic_tools::ShapeShifter& message, const std::string& /*base*/,
                   Pipeline* pipeline) {
  if (const auto scan = message_in<LandmarkObservationArray>(message)) {
    pipeline->handle(*scan);
  } else {
    std::visit([&](const auto& seen) { pipeline->handle(seen); }, landmarks_in(message));
  }
}

template <typename Pipeline>
void hand_over_any(const Input<BeaconRange>& /*input*/, const topic_tools::ShapeShifter& message,
                   const std::string& /*base*/, Pipeline* pipeline) {
  if (const auto range = message_in<BeaconRange>(message)) {
    pipeline->handle(*range);
  } else {
    pipeline->handle(range_in(message, pipeline->antenna(), ros::Time::now()));
  }
}

}  // namespace pf_resampling
