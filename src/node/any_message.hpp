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

/// Odometry; or a pose in the odometry frame of the robot, whose frame is `base`. Throws Error, as
/// all of these do, for what cannot be read.
template <typename Pipeline>
nav_msgs::Odometry read_any(const Input<nav_msgs::Odometry>& /*input*/,
                            const topic_tools::ShapeShifter& message, const std::string& base,
                            const Pipeline& /*pipeline*/) {
  using Pose = geometry_msgs::PoseWithCovarianceStamped;
  if (const auto odometry = message_in<nav_msgs::Odometry>(message)) return *odometry;
  if (const auto pose = message_in<Pose>(message)) return to_odometry_message(*pose, base);
  throw Error("odometry comes as " + message.getDataType() +
              "; nav_msgs/Odometry or geometry_msgs/PoseWithCovarianceStamped is needed");
}

template <typename Pipeline>
std::variant<LandmarkObservationArray, tf2_msgs::TFMessage> read_any(
    const Input<LandmarkObservationArray>& /*input*/, const topic_tools::ShapeShifter& message,
    const std::string& /*base*/, const Pipeline& /*pipeline*/) {
  if (const auto scan = message_in<LandmarkObservationArray>(message)) return *scan;
  return landmarks_in(message);
}

template <typename Pipeline>
BeaconRange read_any(const Input<BeaconRange>& /*input*/, const topic_tools::ShapeShifter& message,
                     const std::string& /*base*/, const Pipeline& pipeline) {
  if (const auto range = message_in<BeaconRange>(message)) return *range;
  return range_in(message, pipeline.antenna(), ros::Time::now());
}

}  // namespace pf_resampling
