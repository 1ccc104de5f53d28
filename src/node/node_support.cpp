#include "src/node/node_support.hpp"

#include <ros/callback_queue.h>

#include <sstream>

namespace pf_resampling {

std::string name_of_this_node() {
  return ros::this_node::getName().substr(1);
}

void for_each_configuration(const ros::NodeHandle& private_node,
                            const std::function<void(const Configuration&)>& take) {
  XmlRpc::XmlRpcValue parameters;
  ros::param::get(private_node.getNamespace(), parameters);
  Configuration own = configuration_of(parameters);
  const auto files = own.values.find("files");
  if (files != own.values.end()) {
    std::istringstream paths(files->second);
    for (std::string path; paths >> path;) take(read_configuration(path));
    own.values.erase(files);
  }
  take(own);
}

void spin(const std::function<bool()>& process_next) {
  bool is_busy = false;
  while (ros::ok()) {
    ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(is_busy ? 0.0 : 0.1));
    is_busy = process_next();
  }
}

FilterPublishers::FilterPublishers(ros::NodeHandle* node)
    : pose_(node->advertise<geometry_msgs::PoseWithCovarianceStamped>("pose", kNodeOutputQueue)),
      path_(node->advertise<nav_msgs::Path>("path", 1, true)),
      particlecloud_(node->advertise<geometry_msgs::PoseArray>("particlecloud", 5)),
      particles_(node->advertise<sensor_msgs::PointCloud2>("particles", 5)),
      diagnostics_(node->advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 20)),
      markers_(TwoPublishers::advertised<visualization_msgs::MarkerArray>(node, "markers", 20)),
      status_(TwoPublishers::advertised<FilterStatus>(node, "status", kNodeOutputQueue)) {}

void FilterPublishers::connect(PipelineSinks* sinks) {
  sinks->pose = [this](const auto& message) { pose_.publish(message); };
  sinks->path = [this](const auto& message) { path_.publish(message); };
  sinks->particlecloud = [this](const auto& message) { particlecloud_.publish(message); };
  sinks->particles = [this](const auto& message) { particles_.publish(message); };
  sinks->markers = [this](const auto& message) { markers_.publish(message); };
  sinks->status = [this](const auto& message) { status_.publish(message); };
  sinks->diagnostics = [this](const auto& message) { diagnostics_.publish(message); };
  sinks->transform = [this](const auto& transform) { broadcaster_.sendTransform(transform); };
  sinks->wants_hypotheses = [this] { return status_.is_heard() || markers_.is_heard(); };
  sinks->log = log();
  sinks->stopwatch = [] { return ros::SteadyTime::now().toSec(); };
}

std::function<void(LogLevel, const std::string&)> FilterPublishers::log() {
  return [](LogLevel level, const std::string& text) {
    if (level == LogLevel::error) {
      ROS_ERROR("%s", text.c_str());
    } else if (level == LogLevel::warning) {
      ROS_WARN("%s", text.c_str());
    } else {
      ROS_INFO("%s", text.c_str());
    }
  };
}

SilenceWatch::SilenceWatch(ros::NodeHandle* node, std::function<void()> report)
    : report_(std::move(report)) {
  timer_ = node->createSteadyTimer(ros::WallDuration(1.0), [this](const ros::SteadyTimerEvent&) {
    if (Clock::now() - last_message_ > std::chrono::seconds(2)) report_();
  });
}

}  // namespace pf_resampling
