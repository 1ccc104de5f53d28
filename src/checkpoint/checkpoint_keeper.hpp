#pragma once

#include <diagnostic_msgs/DiagnosticArray.h>
#include <diagnostic_msgs/DiagnosticStatus.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <string>
#include <utility>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/files/archive.hpp"
#include "pf_resampling_core/parameters/parameters.hpp"
#include "src/diagnostics/log_level.hpp"

namespace pf_resampling {

struct CheckpointOptions {
  std::string file;      ///< empty: none
  double period = 10.0;  ///< s, of the wall clock
};

/// Adds them as parameters, in the group "checkpoint".
void add_parameters(CheckpointOptions* options, ParameterList* list);

/// Keeps a node's checkpoint: goes on from it at the start, writes it anew from time to time, in a
/// thread of its own, so that the node does not wait for the disk; and tells of it in the
/// diagnostics.
class CheckpointKeeper {
 public:
  /// Writes what it holds to the file of this name. Throws Error when that cannot be.
  using Write = std::function<void(const std::string& path)>;
  using Log = std::function<void(LogLevel, const std::string&)>;

  CheckpointKeeper(CheckpointOptions options, Log log)
      : options_(std::move(options)), log_(std::move(log)), last_(Clock::now()) {}
  /// Waits for what is being written.
  ~CheckpointKeeper();
  CheckpointKeeper(const CheckpointKeeper&) = delete;
  CheckpointKeeper& operator=(const CheckpointKeeper&) = delete;

  /// If there is a file: `resume` goes on from it, or throws with nothing changed; then the node
  /// starts anew, which is told of until the next one is written.
  void start(const std::function<void(const std::string& path)>& resume);

  /// Whether it should be written again: the period has gone by, and the last is done.
  bool is_due();
  /// Has it written by a thread of its own, which `write` has to be fit for.
  void write(Write write);
  /// Writes at once, to `path`, or to the file of the options if that is empty; returns what was
  /// done in one line, or throws Error.
  std::string write_now(const std::string& path, const Write& write);

  /// Of a pipeline: when one is due, a copy of what it knows is handed to the thread.
  template <typename Pipeline>
  void write_when_due(Pipeline* pipeline) {
    if (!is_due()) return;
    auto checkpoint = pipeline->checkpoint();
    if (!checkpoint) return;
    write([state = std::move(*checkpoint)](const std::string& path) {
      write_saved(kCheckpointFile, path, state);
    });
  }
  /// Writes what it knows at once, as write_now().
  template <typename Pipeline>
  std::string save(const std::string& path, Pipeline* pipeline) {
    return write_now(path, [pipeline](const std::string& file) {
      const auto state = pipeline->checkpoint();
      if (!state) throw Error("checkpoint: there is nothing to save yet; wait for the first pose");
      write_saved(kCheckpointFile, file, *state);
    });
  }

  /// Adds the entry called `name` to the diagnostics, if there is anything to tell.
  void report(const std::string& name, diagnostic_msgs::DiagnosticArray* array);
  diagnostic_msgs::DiagnosticStatus diagnostic(const std::string& name);
  bool is_used() const { return !options_.file.empty(); }

 private:
  using Clock = std::chrono::steady_clock;

  void take_result(bool wait);

  CheckpointOptions options_;
  Log log_;
  std::string start_ = "from nothing";  // how the node started
  Clock::time_point last_;              // when the last was begun
  std::future<std::string> writing_;    // what went wrong; empty if nothing did
  std::string problem_;                 // the last, not yet put right by a file that was written
  std::uint64_t written_ = 0, failed_ = 0;
};

}  // namespace pf_resampling
