// Range-beacon localization as a node: subscribes, hands on to the pipeline, publishes.
#include <pf_resampling/Checkpoint.h>
#include <pf_resampling/SetParticles.h>
#include <std_srvs/Empty.h>

#include <cstdio>

#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"
#include "pf_resampling_core/error.hpp"
#include "src/node/node_support.hpp"
#include "src/node/reconfigure_server.hpp"

namespace pf_resampling {
namespace {

class BeaconMclNode {
 public:
  BeaconMclNode(ros::NodeHandle* node, const BeaconMclPipelineOptions& options)
      : publishers_(node),
        pipeline_(options, sinks()),
        checkpoints_(options.checkpoint, sinks().log),
        parameters_(
            ros::NodeHandle("~"), [this] { return pipeline_.live_parameters(); },
            [this](const auto& values) { pipeline_.set_parameters(values); }),
        silence_(node, [this](ros::Time now) { pipeline_.report_silence(now); }) {
    checkpoints_.start(
        [this](const std::string& path) { pipeline_.resume(read_beacon_mcl_checkpoint(path)); });
    const auto hints = ros::TransportHints().tcpNoDelay();
    subscribers_ = {
        node->subscribe("odom", kNodeInputQueue, &BeaconMclNode::take<nav_msgs::Odometry>, this,
                        hints),
        node->subscribe("ranges", kNodeInputQueue, &BeaconMclNode::take<BeaconRange>, this, hints),
        node->subscribe("sensor_ranges", kNodeInputQueue, &BeaconMclNode::take<sensor_msgs::Range>,
                        this, hints),
        node->subscribe("beacons", 10, &BeaconMclNode::take<BeaconArray>, this),
        node->subscribe("initialpose", 10,
                        &BeaconMclNode::take<geometry_msgs::PoseWithCovarianceStamped>, this),
        node->subscribe("/tf_static", 100, &BeaconMclNode::take<tf2_msgs::TFMessage>, this),
        node->subscribe("/tf", kNodeInputQueue, &BeaconMclNode::take<tf2_msgs::TFMessage>, this),
    };
    services_ = {
        node->advertiseService("global_localization", &BeaconMclNode::global_localization, this),
        node->advertiseService("reset", &BeaconMclNode::reset, this),
        node->advertiseService("set_particles", &BeaconMclNode::set_particles, this),
        node->advertiseService("checkpoint", &BeaconMclNode::checkpoint, this),
    };
  }

  /// Also has a checkpoint written when one is due.
  bool process_next() {
    checkpoints_.write_when_due(&pipeline_);
    return pipeline_.process_next();
  }

 private:
  BeaconMclSinks sinks() {
    BeaconMclSinks sinks;
    publishers_.connect(&sinks);
    sinks.more_diagnostics = [this](diagnostic_msgs::DiagnosticArray* array) {
      checkpoints_.report("beacon_mcl: checkpoint", array);
    };
    return sinks;
  }

  template <typename Message>
  void take(const typename Message::ConstPtr& message) {
    silence_.message_came();
    pipeline_.handle(*message);
  }

  bool global_localization(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
    pipeline_.global_localization();
    return true;
  }

  bool reset(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
    pipeline_.reset();
    return true;
  }

  bool checkpoint(Checkpoint::Request& request, Checkpoint::Response& response) {
    answer([&] { return checkpoints_.save(request.file, &pipeline_); }, &response);
    return true;
  }

  bool set_particles(SetParticles::Request& request, SetParticles::Response& response) {
    answer([&] { return pipeline_.set_particles(request.particles, request.weights); }, &response);
    return true;
  }

  FilterPublishers publishers_;
  BeaconMclPipeline pipeline_;
  CheckpointKeeper checkpoints_;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<ros::ServiceServer> services_;
  ReconfigureServer parameters_;
  SilenceWatch silence_;
};

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  ros::init(argc, argv, "beacon_mcl");
  ros::NodeHandle node;
  try {
    pf_resampling::BeaconMclPipelineOptions options;
    options.deferred = true;
    options.name = pf_resampling::name_of_this_node();
    pf_resampling::for_each_configuration(ros::NodeHandle("~"),
                                          [&](const auto& part) { apply(part, &options); });
    pf_resampling::BeaconMclNode localization(&node, options);
    pf_resampling::spin([&] { return localization.process_next(); });
  } catch (const pf_resampling::Error& error) {
    std::fprintf(stderr, "beacon_mcl_node: %s\n", error.what());
    return 1;
  }
  return 0;
}
