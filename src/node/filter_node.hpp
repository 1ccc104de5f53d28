#pragma once

#include <pf_resampling/Checkpoint.h>
#include <std_srvs/Empty.h>

#include <cstdio>
#include <exception>
#include <fstream>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "src/checkpoint/checkpoint_keeper.hpp"
#include "src/node/any_message.hpp"
#include "src/node/flight_recorder.hpp"
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
        recorder_(&pipeline_, !options.checkpoint.file.empty()),
        lost_flight_(options.checkpoint.file + ".lost"),
        checkpoints_(options.checkpoint, publishers_.log()),
        folder_(options.directory),
        parameters_(
            ros::NodeHandle("~"), [this] { return pipeline_.live_parameters(); },
            [this](const auto& values) {
              pipeline_.ask("set_parameters", [&] {
                pipeline_.set_parameters(values);
                recorder_.clear();
                return std::string();
              });
            }),
        silence_(node, [this] {
          pipeline_.guard("clock", [this] {
            const ros::Time now = ros::Time::now();
            if (!now.isZero()) pipeline_.report_silence(now);
          });
        }) {
    checkpoints_.start([this](const std::string& path) { pipeline_.resume(path); });
    base_ = options.frames.base;
    for_each_input<Pipeline>(
        [this](const auto& input, const char* topic) { subscribe(input, topic); });
    say_what_is_missing();
    watch_ = node->createSteadyTimer(ros::WallDuration(10.0), [this](const auto&) {
      pipeline_.guard("log", [this] { say_what_is_missing(); });
    });
    serve("reset", [this] { pipeline_.reset(); });
    serve<Checkpoint>("checkpoint", [this](const auto& request) {
      // An empty name means checkpoint/file, which is the owner's choice.
      const std::string path =
          request.file.empty() ? "" : path_to_write(request.file, kCheckpointFile);
      return checkpoints_.save(path, &pipeline_);
    });
    advertise<Checkpoint::Request, Checkpoint::Response>(
        "save_flight", [this](Checkpoint::Request& request, Checkpoint::Response& response) {
          const auto write = [&] { return recorder_.write(path_of_flight(request.file)); };
          answer([&] { return pipeline_.ask("save_flight", write); }, &response);
          return true;
        });
  }

  /// Answers a service by what `work` makes of the request: what it did, in one line, or an Error.
  template <typename Service, typename Work>
  void serve(const std::string& name, const Work& work) {
    using Request = typename Service::Request;
    using Response = typename Service::Response;
    advertise<Request, Response>(name, [this, name, work](Request& request, Response& response) {
      const auto done = [&] { return work(request); };
      recorder_.clear();
      answer([&] { return pipeline_.ask(name.c_str(), done); }, &response);
      return true;
    });
  }  // NOLINT(clang-analyzer-cplusplus.NewDeleteLeaks): boost::function frees what it holds.
  /// Likewise one without request and response.
  template <typename Work>
  void serve(const std::string& name, const Work& work) {
    using std_srvs::Empty;
    advertise<Empty::Request, Empty::Response>(
        name, [this, name, work](Empty::Request&, Empty::Response&) {
          recorder_.clear();
          return pipeline_.guard(name.c_str(), work);
        });
  }  // NOLINT(clang-analyzer-cplusplus.NewDeleteLeaks): likewise.

  /// The file that a caller of a service names, to be read or written; see ServiceFolder.
  std::string path_of(const std::string& name) const { return folder_.path_of(name); }
  std::string path_to_write(const std::string& name, const FileKind& kind) const {
    return folder_.path_to_write(name, kind);
  }

  /// Says which parameters hold now, after the pipeline has changed some by itself.
  void publish_parameters() { parameters_.publish(); }

  /// Uses the next observation; returns whether there was one. Also has a checkpoint written when
  /// one is due.
  bool process_next() {
    bool was_one = false;
    pipeline_.guard("checkpoint", [&] { checkpoints_.write_when_due(&pipeline_); });
    pipeline_.guard("flight", [&] { recorder_.begin_when_due(); });
    const std::int64_t done = pipeline_.take_overs().done;
    const int queued = pipeline_.queued();
    pipeline_.guard(Pipeline::kObservations, [&] { was_one = pipeline_.process_next(); });
    if (was_one || pipeline_.queued() != queued || pipeline_.take_overs().done != done) {
      recorder_.note_step(done);
      pipeline_.guard("flight", [&] { write_flight_when_lost(); });
    }
    if (was_one && !std::exchange(is_running_, true)) {
      ROS_INFO("received the first %s: the filter runs", Pipeline::kObservations);
    }
    return was_one;
  }

  Pipeline& pipeline() { return pipeline_; }

 private:
  std::string path_of_flight(const std::string& name) const {
    path_to_write(name + ".checkpoint", kCheckpointFile);
    std::string path = path_of(name);
    if (std::ifstream(path + ".bag")) throw Error(path + ".bag is there: give another name");
    return path;
  }

  /// Beside the checkpoint.
  void write_flight_when_lost() {
    const bool is_lost = pipeline_.lost_probability() > kLikelyLost;
    if (is_lost && !is_lost_ && recorder_.has_flight()) {
      ROS_WARN("lost: %s", recorder_.write(lost_flight_).c_str());
    }
    is_lost_ = is_lost;
  }

  typename Pipeline::Sinks connected(typename Pipeline::Sinks sinks, const std::string& name) {
    publishers_.connect(&sinks);
    sinks.more_diagnostics = [this, name](diagnostic_msgs::DiagnosticArray* array) {
      checkpoints_.report(name + ": checkpoint", array);
    };
    return sinks;
  }

  /// Under its private name (~reset), and under the name in the namespace of the node (reset).
  template <typename Request, typename Response>
  void advertise(const std::string& name, const boost::function<bool(Request&, Response&)>& serve) {
    for (ros::NodeHandle* node : {&private_node_, node_}) {
      services_.push_back(node->advertiseService<Request, Response>(name, serve));
    }
  }

  template <typename Message>
  void subscribe(const Input<Message>& input, const char* topic) {
    // A publisher of any type is heard where messages of other packages are known.
    if constexpr (kTakesOtherTypes<Message>) {
      listen<topic_tools::ShapeShifter>(topic, [this, input, topic](const auto& message) {
        take_if_readable(topic,
                         [&] { return read_any(input, LiveMessage{message}, base_, pipeline_); });
      });
    } else {
      listen<Message>(topic, [this, topic](const auto& message) { hand_over(topic, message); });
    }
  }

  /// Hands over what `read` makes of a message; it throws Error for one that cannot be read.
  template <typename Read>
  void take_if_readable(const char* topic, const Read& read) {
    std::optional<std::decay_t<decltype(read())>> message;
    try {
      message = read();
    } catch (const Error& error) {
      pipeline_.note_unreadable(name_of_topic(topic), error.what());
      return;
    }
    hand_over(topic, *message);
  }
  template <typename Message>
  void hand_over(const char* topic, const Message& message) {
    recorder_.note(message, std::string(topic) == "/tf_static");
    pipeline_.handle(message);
  }
  template <typename... Messages>
  void hand_over(const char* topic, const std::variant<Messages...>& any) {
    std::visit([&](const auto& message) { hand_over(topic, message); }, any);
  }

  template <typename Message, typename Take>
  void listen(const char* topic, const Take& take) {
    const std::size_t place = inputs_.size();
    const boost::function<void(const boost::shared_ptr<const Message>&)> heard =
        [this, place, topic, take](const boost::shared_ptr<const Message>& message) {
          silence_.message_came();
          inputs_[place].has_come = true;
          pipeline_.guard(name_of_topic(topic), [&] { take(*message); });
        };
    HeardInput input;
    input.topic = topic;
    input.subscriber = node_->subscribe<Message>(topic, kNodeInputQueue, heard, ros::VoidConstPtr(),
                                                 ros::TransportHints().tcpNoDelay());
    inputs_.push_back(std::move(input));
  }

  /// Says, until the filter runs, which inputs have not come and whether anybody publishes them.
  void say_what_is_missing() {
    if (is_running_) return watch_.stop();
    std::string missing;
    for (const HeardInput& input : inputs_) {
      const std::string topic = input.topic;
      const bool is_needed = topic == pipeline_.odometry_input() || topic == "beacons" ||
                             topic.find(Pipeline::kObservations) != std::string::npos;
      if (!is_needed || input.has_come) continue;
      missing += (missing.empty() ? "" : ", ") + node_->resolveName(topic);
      if (input.subscriber.getNumPublishers() > 0) continue;
      const std::string instead = topic == "odom" ? pipeline_.odometry_elsewhere() : "";
      missing += " (nobody publishes it" + (instead.empty() ? "" : "; " + instead) + ")";
    }
    if (!missing.empty()) ROS_INFO("nothing received yet on %s", missing.c_str());
  }

  struct HeardInput {
    const char* topic = "";
    ros::Subscriber subscriber;
    bool has_come = false;
  };

  ros::NodeHandle* node_;
  ros::NodeHandle private_node_{"~"};
  FilterPublishers publishers_;
  Pipeline pipeline_;
  FlightRecorder<Pipeline> recorder_;
  std::string lost_flight_;  // its name
  bool is_lost_ = true;
  CheckpointKeeper checkpoints_;
  ServiceFolder folder_;
  std::string base_;
  std::vector<HeardInput> inputs_;
  bool is_running_ = false;
  ros::SteadyTimer watch_;
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
