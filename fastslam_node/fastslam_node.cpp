// FastSLAM as a node: subscribes, hands on to the pipeline, publishes.
#include <pf_resampling/Checkpoint.h>
#include <pf_resampling/LoadMap.h>
#include <pf_resampling/SaveMap.h>
#include <pf_resampling/SetParticles.h>
#include <std_srvs/Empty.h>

#include <cstdio>

#include "fastslam_node/fastslam_pipeline.hpp"
#include "pf_resampling_core/error.hpp"
#include "src/node/node_support.hpp"
#include "src/node/reconfigure_server.hpp"

namespace pf_resampling {
namespace {

class FastSlamNode {
 public:
  FastSlamNode(ros::NodeHandle* node, const FastSlamPipelineOptions& options)
      : publishers_(node),
        landmark_map_(node->advertise<LandmarkMap>("landmark_map", 1, true)),
        pipeline_(options, sinks()),
        checkpoints_(options.checkpoint, sinks().log),
        parameters_(
            ros::NodeHandle("~"), [this] { return pipeline_.live_parameters(); },
            [this](const auto& values) { pipeline_.set_parameters(values); }),
        silence_(node, [this](ros::Time now) { pipeline_.report_silence(now); }) {
    checkpoints_.start(
        [this](const std::string& path) { pipeline_.resume(read_fastslam_checkpoint(path)); });
    const auto hints = ros::TransportHints().tcpNoDelay();
    subscribers_ = {
        node->subscribe("odom", kNodeInputQueue, &FastSlamNode::take<nav_msgs::Odometry>, this,
                        hints),
        node->subscribe("landmarks", kNodeInputQueue, &FastSlamNode::take<LandmarkObservationArray>,
                        this, hints),
        node->subscribe("initialpose", 10,
                        &FastSlamNode::take<geometry_msgs::PoseWithCovarianceStamped>, this),
        node->subscribe("/tf_static", 100, &FastSlamNode::take<tf2_msgs::TFMessage>, this),
        node->subscribe("/tf", kNodeInputQueue, &FastSlamNode::take<tf2_msgs::TFMessage>, this),
    };
    services_ = {
        node->advertiseService("reset", &FastSlamNode::reset, this),
        node->advertiseService("save_map", &FastSlamNode::save_map, this),
        node->advertiseService("load_map", &FastSlamNode::load_map, this),
        node->advertiseService("set_particles", &FastSlamNode::set_particles, this),
        node->advertiseService("checkpoint", &FastSlamNode::checkpoint, this),
    };
  }

  /// Also has a checkpoint written when one is due.
  bool process_next() {
    checkpoints_.write_when_due(&pipeline_);
    return pipeline_.process_next();
  }

 private:
  FastSlamSinks sinks() {
    FastSlamSinks sinks;
    publishers_.connect(&sinks);
    sinks.more_diagnostics = [this](diagnostic_msgs::DiagnosticArray* array) {
      checkpoints_.report("fastslam: checkpoint", array);
    };
    sinks.landmark_map = [this](const auto& message) { landmark_map_.publish(message); };
    return sinks;
  }

  template <typename Message>
  void take(const typename Message::ConstPtr& message) {
    silence_.message_came();
    pipeline_.handle(*message);
  }

  bool reset(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
    pipeline_.reset();
    return true;
  }

  bool save_map(SaveMap::Request& request, SaveMap::Response& response) {
    answer([&] { return pipeline_.save_map(request.file); }, &response);
    return true;
  }

  bool load_map(LoadMap::Request& request, LoadMap::Response& response) {
    answer([&] { return pipeline_.load_map(request.file, request.frozen); }, &response);
    parameters_.publish();  // map/frozen
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
  ros::Publisher landmark_map_;
  FastSlamPipeline pipeline_;
  CheckpointKeeper checkpoints_;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<ros::ServiceServer> services_;
  ReconfigureServer parameters_;
  SilenceWatch silence_;
};

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  ros::init(argc, argv, "fastslam");
  ros::NodeHandle node;
  try {
    pf_resampling::FastSlamPipelineOptions options;
    options.deferred = true;
    options.name = pf_resampling::name_of_this_node();
    pf_resampling::for_each_configuration(ros::NodeHandle("~"),
                                          [&](const auto& part) { apply(part, &options); });
    pf_resampling::FastSlamNode mapping(&node, options);
    pf_resampling::spin([&] { return mapping.process_next(); });
  } catch (const pf_resampling::Error& error) {
    std::fprintf(stderr, "fastslam_node: %s\n", error.what());
    return 1;
  }
  return 0;
}
