#pragma once

#include <diagnostic_msgs/DiagnosticArray.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "pf_resampling_core/parameters/parameters.hpp"
#include "src/checkpoint/periodic_writer.hpp"
#include "src/checkpoint/saved_pose.hpp"

namespace pf_resampling {

struct SavedPoseOptions {
  double save_every = 0.0;  ///< s, of the wall clock; 0: the pose is neither saved nor read
  double oldest = 3600.0;   ///< s; older ones are refused
};

/// Adds them as parameters, in the group "pose".
void add_parameters(SavedPoseOptions* options, ParameterList* list);

/// Keeps a node's pose: reads it at the start, writes it from time to time and at the end, and
/// tells of it in the diagnostics.
class PoseKeeper {
 public:
  /// `default_file`: the path where the pose is; it may throw Error, which is told and leaves the
  /// node without.
  PoseKeeper(const SavedPoseOptions& options, const std::function<std::string()>& default_file,
             const PeriodicWriter::Log& log);

  bool is_used() const { return is_wanted_; }

  /// The pose of the file, if there is one that can be read. What a killed process has left
  /// unfinished is removed.
  std::optional<SavedPose> read();

  const std::string& file() const { return writer_.file(); }

  /// Of a pipeline: when it is due and there is a new one, the pose is written by a thread.
  template <typename Pipeline>
  void write_when_due(Pipeline* pipeline) {
    if (!writer_.is_due()) return;
    const std::optional<SavedPose> pose = pipeline->pose_to_save();
    if (!pose || pose->stamp == last_stamp_) return;
    last_stamp_ = pose->stamp;
    writer_.write([pose = *pose](const std::string& path) { write_saved_pose(path, pose); });
  }
  /// At once, for the end of the node. Throws Error.
  template <typename Pipeline>
  void write_now(Pipeline* pipeline) {
    if (!writer_.is_used()) return;
    const std::optional<SavedPose> pose = pipeline->pose_to_save();
    if (!pose) return;
    writer_.write_now([&](const std::string& path) { write_saved_pose(path, *pose); });
  }

  /// Adds the entry called `name` to the diagnostics, if poses are saved. `started`: what became of
  /// the one that was read.
  void report(const std::string& name, const std::string& started,
              diagnostic_msgs::DiagnosticArray* array);

 private:
  static std::string file_of(const SavedPoseOptions& options,
                             const std::function<std::string()>& default_file,
                             std::string* problem);

  bool is_wanted_;
  std::string problem_;  // with the name of the file
  PeriodicWriter::Log log_;
  PeriodicWriter writer_;
  std::int64_t last_stamp_ = -1;
};

}  // namespace pf_resampling
