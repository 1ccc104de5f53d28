#pragma once

#include <pf_resampling/Checkpoint.h>
#include <pf_resampling/SetParticles.h>
#include <std_srvs/Empty.h>

#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "pf_resampling_core/files/new_file.hpp"
#include "src/checkpoint/checkpoint_keeper.hpp"
#include "src/node/node_support.hpp"
#include "src/node/reconfigure_server.hpp"
#include "src/node/service_folder.hpp"
#include "src/pipeline/inputs.hpp"

namespace pf_resampling {

/// A filter's pipeline as a node: subscribes, hands on, publishes; services, live parameters,
/// checkpoints.
template <typename Pipeline>
class FilterNode {
 public:
  /// `sinks`: for what the filter alone gives out; the common ones are connected here.
  FilterNode(ros::NodeHandle* node, const typename Pipeline::Options& options,
             const typename Pipeline::Sinks& sinks)
      : node_(node),
        publishers_(node),
        pipeline_(options, connected(sinks, options.name)),
        checkpoints_(options.checkpoint, publishers_.log()),
        folder_(options.directory),
        parameters_(
            ros::NodeHandle("~"), [this] { return pipeline_.live_parameters(); },
            [this](const auto& values) {
              pipeline_.ask("set_parameters", [&] {
                pipeline_.set_parameters(values);
                return std::string();
              });
            }),
        silence_(node, [this](ros::Time now) {
          pipeline_.guard("clock", [&] { pipeline_.report_silence(now); });
        }) {
    checkpoints_.start([this](const std::string& path) { pipeline_.resume(path); });
    for_each_input<Pipeline>(
        [this](const auto& input, const char* topic) { subscribe(input, topic); });
    serve("reset", [this] { pipeline_.reset(); });
    serve<SetParticles>("set_particles", [this](const auto& request) {
      return pipeline_.set_particles(request.particles, request.weights);
    });
    serve<Checkpoint>("checkpoint", [this](const auto& request) {
      // An empty name means checkpoint/file, which is the owner's choice.
      return checkpoints_.save(request.file.empty() ? "" : path_of(request.file), &pipeline_);
    });
  }

  /// Answers a service by what `work` makes of the request: what it did, in one line, or an Error.
  template <typename Service, typename Work>
  void serve(const std::string& name, const Work& work) {
    using Request = typename Service::Request;
    using Response = typename Service::Response;
    services_.push_back(node_->advertiseService<Request, Response>(
        name, [this, name, work](Request& request, Response& response) {
          answer([&] { return pipeline_.ask(name.c_str(), [&] { return work(request); }); },
                 &response);
          return true;
        }));
  }
  /// Likewise one without request and response.
  template <typename Work>
  void serve(const std::string& name, const Work& work) {
    using std_srvs::Empty;
    services_.push_back(node_->advertiseService<Empty::Request, Empty::Response>(
        name, [this, name, work](Empty::Request&, Empty::Response&) {
          return pipeline_.guard(name.c_str(), work);
        }));
  }

  /// The file that a caller of a service names; see ServiceFolder.
  std::string path_of(const std::string& name) const { return folder_.path_of(name); }

  /// Says which parameters hold now, after the pipeline has changed some by itself.
  void publish_parameters() { parameters_.publish(); }

  /// Uses the next observation; returns whether there was one. Also has a checkpoint written when
  /// one is due.
  bool process_next() {
    bool was_one = false;
    pipeline_.guard("checkpoint", [&] { checkpoints_.write_when_due(&pipeline_); });
    pipeline_.guard(Pipeline::kObservations, [&] { was_one = pipeline_.process_next(); });
    return was_one;
  }

  Pipeline& pipeline() { return pipeline_; }

 private:
  typename Pipeline::Sinks connected(typename Pipeline::Sinks sinks, const std::string& name) {
    publishers_.connect(&sinks);
    sinks.more_diagnostics = [this, name](diagnostic_msgs::DiagnosticArray* array) {
      checkpoints_.report(name + ": checkpoint", array);
    };
    return sinks;
  }

  template <typename Message>
  void subscribe(const Input<Message>& /*input*/, const char* topic) {
    const boost::function<void(const typename Message::ConstPtr&)> take =
        [this](const typename Message::ConstPtr& message) {
          silence_.message_came();
          hand_over(*message, &pipeline_);
        };
    subscribers_.push_back(node_->subscribe<Message>(
        topic, kNodeInputQueue, take, ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay()));
  }

  ros::NodeHandle* node_;
  FilterPublishers publishers_;
  Pipeline pipeline_;
  CheckpointKeeper checkpoints_;
  ServiceFolder folder_;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<ros::ServiceServer> services_;
  ReconfigureServer parameters_;
  SilenceWatch silence_;
};

/// The main function of a filter's node, called `name` unless it is remapped. `connect` gets the
/// node handle, the options and the sinks, for what the filter alone has and gives out; `serve` the
/// FilterNode, for services that it alone has.
template <typename Pipeline, typename Connect, typename Serve>
int run_filter_node(int argc, char** argv, const char* name, const Connect& connect,
                    const Serve& serve) {
  remove_unfinished_on_signals();  // roscpp takes SIGINT and SIGPIPE itself
  ros::init(argc, argv, name);
  ros::NodeHandle handle;
  try {
    typename Pipeline::Options options;
    options.deferred = true;
    options.name = name_of_this_node();
    for_each_configuration(ros::NodeHandle("~"),
                           [&](const Configuration& part) { apply(part, &options); });
    typename Pipeline::Sinks sinks;
    connect(&handle, &options, &sinks);
    FilterNode<Pipeline> node(&handle, options, sinks);
    serve(&node);
    spin([&] { return node.process_next(); });
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s_node: %s\n", name, error.what());
    return 1;
  }
  return 0;
}

}  // namespace pf_resampling
