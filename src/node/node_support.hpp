#pragma once

#include <ros/ros.h>
#include <tf2_ros/transform_broadcaster.h>

#include <chrono>
#include <functional>

#include "pf_resampling_core/error.hpp"
#include "src/configuration/configuration.hpp"
#include "src/messages/rejects.hpp"
#include "src/pipeline/pipeline_sinks.hpp"

namespace pf_resampling {

/// With its namespace and without a slash in front: "robot1/fastslam". Diagnostics of all nodes
/// come together on one topic.
std::string name_of_this_node();

/// Queues long enough for a bag played at many times its speed.
constexpr std::uint32_t kNodeInputQueue = 2000;
constexpr std::uint32_t kNodeOutputQueue = 200;

/// Hands `take` the configurations that a node is given, later ones to win: the YAML files in its
/// private parameter `files` (names, separated by spaces), then its other private parameters.
/// Throws Error naming file or parameter.
void for_each_configuration(const ros::NodeHandle& private_node,
                            const std::function<void(const Configuration&)>& take);

/// Runs the node: takes all messages that have come, then works off one observation
/// (`process_next`, which says whether there was one), and so on; so what is out of date can be
/// told and dropped, however long an update takes.
void spin(const std::function<bool()>& process_next);

/// Answers a service: `work` returns what it did, or throws Error.
template <typename Work, typename Response>
void answer(const Work& work, Response* response) {
  try {
    response->message = work();
    response->success = true;
    ROS_INFO("%s", response->message.c_str());
  } catch (const Error& error) {
    response->message = shown_detail(error.what());
    response->success = false;
    ROS_ERROR("%s", response->message.c_str());
  }
}

/// A topic under its private name (~status), and under the name in the namespace of the node
/// (status).
class TwoPublishers {
 public:
  template <typename Message>
  static TwoPublishers advertised(ros::NodeHandle* node, const std::string& topic,
                                  std::uint32_t queue, bool latch = false) {
    TwoPublishers publishers;
    publishers.private_ = ros::NodeHandle("~").advertise<Message>(topic, queue, latch);
    publishers.public_ = node->advertise<Message>(topic, queue, latch);
    return publishers;
  }
  bool is_heard() const {
    return private_.getNumSubscribers() > 0 || public_.getNumSubscribers() > 0;
  }
  template <typename Message>
  void publish(const Message& message) const {
    private_.publish(message);
    public_.publish(message);
  }

 private:
  ros::Publisher private_, public_;
};

/// The topics that the nodes of both filters give out.
class FilterPublishers {
 public:
  explicit FilterPublishers(ros::NodeHandle* node);

  /// Sinks into these topics, tf and the log; it has to outlive them.
  void connect(PipelineSinks* sinks);
  /// The sink into the log alone.
  static std::function<void(LogLevel, const std::string&)> log();

 private:
  ros::Publisher pose_, path_, particlecloud_, particles_, diagnostics_;
  TwoPublishers markers_, status_;
  tf2_ros::TransformBroadcaster broadcaster_;
};

/// Pipelines live by the stamps of messages; when none come, somebody has to say so. What the clock
/// of the computer says is of no account: it may be set.
class SilenceWatch {
 public:
  /// Calls `report` every second once there was no message for two. It must not throw.
  SilenceWatch(ros::NodeHandle* node, std::function<void()> report);

  void message_came() { last_message_ = Clock::now(); }

 private:
  using Clock = std::chrono::steady_clock;

  std::function<void()> report_;
  Clock::time_point last_message_;
  ros::SteadyTimer timer_;
};

}  // namespace pf_resampling
