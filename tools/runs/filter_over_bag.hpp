#pragma once

#include <pf_resampling/BeaconArray.h>
#include <pf_resampling/FindingStatus.h>
#include <rosbag/message_instance.h>
#include <std_msgs/UInt64.h>

#include <cstdint>
#include <functional>
#include <iostream>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/parameters/parameters.hpp"
#include "pf_resampling_core/strategy/strategy.hpp"
#include "src/checkpoint/checkpoint.hpp"
#include "src/frames/frame_names.hpp"
#include "src/messages/rejects.hpp"
#include "src/pipeline/inputs.hpp"
#include "src/pipeline/pipeline_sinks.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/bag_writer.hpp"
#include "tools/common/command_line.hpp"
#include "tools/runs/bag_inputs.hpp"

namespace pf_resampling {

/// A filter's run over a bag, in-process and as fast as it goes: inputs and outputs go to another
/// bag, each output at the bag time of the message that caused it.
class FilterOverBag {
 public:
  /// Opens `in.bag` of the command line, which has to outlive it, and begins `out.bag`. Throws
  /// Error.
  explicit FilterOverBag(const CommandLine& line);

  BagWriter& writer() { return writer_; }
  /// Bag time of the message that is being taken.
  const ros::Time& now() const { return now_; }
  /// Whether clouds, markers and paths are to be written; status and diagnostics; or poses alone.
  bool with_pictures() const { return outputs_ == Outputs::all; }
  bool with_status() const { return outputs_ != Outputs::pose_only; }

  /// Writes beacons of the configuration in the place of those of the bag.
  void write_beacons(const std::string& topic, BeaconArray beacons);

  /// The path at the end, for --tum, in the place of the poses as they were given out.
  void take_path(const std::vector<ros::Time>& stamps, const std::vector<Pose2>& poses);

  /// Connects the outputs that are to be written.
  void connect(PipelineSinks* sinks);

  /// Whether it is of a FlightRecorder: a deferred pipeline does again what it did live.
  bool is_flight() const { return is_flight_; }

  /// Hands the pipeline what it takes, in order, from the checkpoint of --resume on; everything but
  /// earlier outputs is copied first.
  template <typename Pipeline>
  void hand_all_to(Pipeline* pipeline, const FrameNames& frames) {
    if (line_.has("resume")) pipeline->resume(line_.text("resume"));
    if (is_flight_) pipeline->take_overs().wanted = 0;
    const auto inputs = bag_inputs(line_, frames.base, pipeline);
    for_each_in_bag(names_of(inputs), frames, [&](const rosbag::MessageInstance& instance) {
      hand_over(instance, inputs, pipeline);
      if (instance.getTopic() == kStepTopic) {
        pipeline->guard(Pipeline::kObservations, [&] { pipeline->process_next(); });
      } else if (instance.getTopic() == kTakeOverTopic) {
        const auto wanted = message_in<std_msgs::UInt64>(instance);
        if (wanted) pipeline->take_overs().wanted = static_cast<std::int64_t>(wanted->data);
      }
    });
  }

  /// Closes the output, and writes the checkpoint of --save-checkpoint. Throws Error, and leaves
  /// none, if the filter has used no observation.
  template <typename Pipeline>
  void finish(Pipeline* pipeline) {
    require_used(in_, *pipeline);
    writer_.finish();
    write_texts(pipeline->findings_in_words());
    if (!line_.has("save-checkpoint")) return;
    const auto checkpoint = pipeline->checkpoint();
    if (!checkpoint) throw Error("checkpoint: there is nothing to save at the end of the bag");
    const auto path = line_.text("save-checkpoint");
    write_saved(kCheckpointFile, path, *checkpoint);
    std::cout << "checkpoint written to " << path << "\n";
  }

  /// Prints what the filter had to say, what was rejected, how the population did, `more`, and what
  /// it took.
  void report(const RejectCounter& rejects, const PopulationStatus& status,
              const std::string& more) const;

 private:
  enum class Outputs { all, no_clouds, pose_only };

  void for_each_in_bag(const std::vector<std::string>& order, const FrameNames& frames,
                       const std::function<void(const rosbag::MessageInstance&)>& take);
  /// The files of --tum and --findings.
  void write_texts(const std::vector<FindingStatus>& findings) const;
  void note_pose(ros::Time stamp, const Pose2& pose);
  bool is_wanted(const rosbag::MessageInstance& message) const;
  void copy_input(const rosbag::MessageInstance& message, const FrameNames& frames);

  const CommandLine& line_;
  std::string in_path_;
  rosbag::Bag in_;
  bool is_flight_ = false;
  std::vector<std::unique_ptr<rosbag::Bag>> more_;
  double start_ = 0.0, duration_ = std::numeric_limits<double>::infinity();  // s
  std::set<std::string> topics_;                                             // empty: all
  ros::Time begin_;
  std::string left_out_;   // a topic that is not copied
  std::string path_text_;  // for --tum
  BagWriter writer_;
  Outputs outputs_ = Outputs::all;
  ros::Time now_;
  double recorded_ = 0.0;  // s
  double wall_start_ = 0.0;
  std::uint64_t poses_ = 0;
  std::vector<std::string> log_;
};

/// Sets the parameters that have options of their own: --seed and --threads.
void apply_run_parameters(const CommandLine& line, const ParameterList& parameters);

/// Prints them as --parameters asks: yaml, template or markdown. `live`: those whose changes a
/// running node takes.
void print_parameters(const CommandLine& line, const ParameterList& parameters,
                      const ParameterList& live);

/// Range-beacon localization and FastSLAM over a bag; the exit code of the program.
int beacon_mcl_over_bag(const CommandLine& line);
int fastslam_over_bag(const CommandLine& line);

/// Prints all their parameters with the values that the command line gives.
void print_beacon_mcl_parameters(const CommandLine& line);
void print_fastslam_parameters(const CommandLine& line);

}  // namespace pf_resampling
