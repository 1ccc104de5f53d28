// Range-beacon localization as a node: subscribes, hands on to the pipeline, publishes.
#include <ros/ros.h>
#include <std_srvs/Empty.h>
#include <tf2_ros/transform_broadcaster.h>

#include <cstdio>

#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"
#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

// Long enough for a bag played at many times its speed.
constexpr std::uint32_t kInputQueue = 2000;
constexpr std::uint32_t kOutputQueue = 200;

/// `files` (YAML, one name or a list of them), then the node's other private parameters.
BeaconMclPipelineOptions read_options(const ros::NodeHandle& private_node) {
  XmlRpc::XmlRpcValue parameters;
  ros::param::get(private_node.getNamespace(), parameters);
  Configuration own = configuration_of(parameters);
  BeaconMclPipelineOptions options;
  const auto files = own.values.find("files");
  if (files != own.values.end()) {
    std::istringstream paths(files->second);
    for (std::string path; paths >> path;) apply(read_configuration(path), &options);
    own.values.erase(files);
  }
  apply(own, &options);
  return options;
}

class BeaconMclNode {
 public:
  BeaconMclNode(ros::NodeHandle* node, const BeaconMclPipelineOptions& options)
      : pose_(node->advertise<geometry_msgs::PoseWithCovarianceStamped>("pose", kOutputQueue)),
        path_(node->advertise<nav_msgs::Path>("path", 1, true)),
        particlecloud_(node->advertise<geometry_msgs::PoseArray>("particlecloud", 5)),
        particles_(node->advertise<sensor_msgs::PointCloud2>("particles", 5)),
        markers_(node->advertise<visualization_msgs::MarkerArray>("markers", 20)),
        status_(node->advertise<FilterStatus>("status", kOutputQueue)),
        diagnostics_(node->advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 20)),
        pipeline_(options, sinks()) {
    const auto hints = ros::TransportHints().tcpNoDelay();
    subscribers_ = {
        node->subscribe("odom", kInputQueue, &BeaconMclNode::take<nav_msgs::Odometry>, this, hints),
        node->subscribe("ranges", kInputQueue, &BeaconMclNode::take<BeaconRange>, this, hints),
        node->subscribe("beacons", 10, &BeaconMclNode::take<BeaconArray>, this),
        node->subscribe("initialpose", 10,
                        &BeaconMclNode::take<geometry_msgs::PoseWithCovarianceStamped>, this),
        node->subscribe("/tf_static", 100, &BeaconMclNode::take<tf2_msgs::TFMessage>, this),
        node->subscribe("/tf", kInputQueue, &BeaconMclNode::take<tf2_msgs::TFMessage>, this),
    };
    services_ = {
        node->advertiseService("global_localization", &BeaconMclNode::global_localization, this),
        node->advertiseService("reset", &BeaconMclNode::reset, this),
    };
    silence_timer_ = node->createWallTimer(
        ros::WallDuration(1.0), [this](const ros::WallTimerEvent&) { report_silence(); });
  }

 private:
  BeaconMclSinks sinks() {
    BeaconMclSinks sinks;
    sinks.pose = [this](const auto& message) { pose_.publish(message); };
    sinks.path = [this](const auto& message) { path_.publish(message); };
    sinks.particlecloud = [this](const auto& message) { particlecloud_.publish(message); };
    sinks.particles = [this](const auto& message) { particles_.publish(message); };
    sinks.markers = [this](const auto& message) { markers_.publish(message); };
    sinks.status = [this](const auto& message) { status_.publish(message); };
    sinks.diagnostics = [this](const auto& message) { diagnostics_.publish(message); };
    sinks.transform = [this](const auto& transform) { broadcaster_.sendTransform(transform); };
    sinks.log = [](LogLevel level, const std::string& text) {
      if (level == LogLevel::warning) {
        ROS_WARN("%s", text.c_str());
      } else {
        ROS_INFO("%s", text.c_str());
      }
    };
    sinks.stopwatch = [] { return ros::WallTime::now().toSec(); };
    return sinks;
  }

  template <typename Message>
  void take(const typename Message::ConstPtr& message) {
    last_message_ = ros::WallTime::now();
    pipeline_.handle(*message);
  }

  // The pipeline lives by the stamps of messages; when none come, somebody has to say so.
  void report_silence() {
    const bool silent = (ros::WallTime::now() - last_message_).toSec() > 2.0;
    if (silent && !ros::Time::now().isZero()) pipeline_.report_silence(ros::Time::now());
  }

  bool global_localization(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
    pipeline_.global_localization();
    return true;
  }

  bool reset(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
    pipeline_.reset();
    return true;
  }

  ros::Publisher pose_, path_, particlecloud_, particles_, markers_, status_, diagnostics_;
  tf2_ros::TransformBroadcaster broadcaster_;
  BeaconMclPipeline pipeline_;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<ros::ServiceServer> services_;
  ros::WallTimer silence_timer_;
  ros::WallTime last_message_;
};

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  ros::init(argc, argv, "beacon_mcl");
  ros::NodeHandle node;
  try {
    pf_resampling::BeaconMclNode localization(&node,
                                              pf_resampling::read_options(ros::NodeHandle("~")));
    ros::spin();
  } catch (const pf_resampling::Error& error) {
    std::fprintf(stderr, "beacon_mcl_node: %s\n", error.what());
    return 1;
  }
  return 0;
}
