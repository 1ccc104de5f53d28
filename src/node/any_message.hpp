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

/// A message that has come, of any type. Messages of bags have the same functions.
struct LiveMessage {
  const topic_tools::ShapeShifter& message;

  const std::string& type() const { return message.getDataType(); }
  /// As a message of this type; null if it is of another. Throws Error if it is of another version.
  template <typename Message>
  typename Message::ConstPtr as() const {
    if (type() != ros::message_traits::DataType<Message>::value()) return nullptr;
    if (message.getMD5Sum() != ros::message_traits::MD5Sum<Message>::value()) {
      throw Error("it is a " + type() + " of another version");
    }
    return message.instantiate<Message>();
  }
  /// To be read by its definition.
  const topic_tools::ShapeShifter& described() const { return message; }
  static ros::Time arrival() { return ros::Time::now(); }
};

/// Odometry; or a pose in the odometry frame of the robot, whose frame is `base`. Throws Error, as
/// all of these do, for what cannot be read.
template <typename Source, typename Pipeline>
nav_msgs::Odometry read_any(const Input<nav_msgs::Odometry>& /*input*/, const Source& message,
                            const std::string& base, const Pipeline& /*pipeline*/) {
  using Pose = geometry_msgs::PoseWithCovarianceStamped;
  if (const auto odometry = message.template as<nav_msgs::Odometry>()) return *odometry;
  if (const auto pose = message.template as<Pose>()) return to_odometry_message(*pose, base);
  throw Error("odometry comes as " + message.type() +
              "; nav_msgs/Odometry or geometry_msgs/PoseWithCovarianceStamped is needed");
}

template <typename Source, typename Pipeline>
std::variant<LandmarkObservationArray, tf2_msgs::TFMessage> read_any(
    const Input<LandmarkObservationArray>& /*input*/, const Source& message,
    const std::string& /*base*/, const Pipeline& /*pipeline*/) {
  if (const auto scan = message.template as<LandmarkObservationArray>()) return *scan;
  return landmarks_in(message.described());
}

template <typename Source, typename Pipeline>
BeaconRange read_any(const Input<BeaconRange>& /*input*/, const Source& message,
                     const std::string& /*base*/, const Pipeline& pipeline) {
  if (const auto range = message.template as<BeaconRange>()) return *range;
  return range_in(message.described(), pipeline.antenna(), message.arrival());
}

}  // namespace pf_resampling
