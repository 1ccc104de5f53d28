#pragma once

#include <diagnostic_msgs/DiagnosticArray.h>
#include <diagnostic_msgs/DiagnosticStatus.h>

#include <functional>
#include <string>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/parameters/parameters.hpp"
#include "src/checkpoint/periodic_writer.hpp"

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
  using Write = PeriodicWriter::Write;
  using Log = PeriodicWriter::Log;

  CheckpointKeeper(const CheckpointOptions& options, const Log& log)
      : log_(log), writer_(options.file, options.period, log) {}

  /// If there is a file: `resume` goes on from it, or throws with nothing changed;
  /// then the node starts anew. What a killed process has left unfinished is removed. Returns
  /// whether it goes on from the file.
  bool start(const std::function<void(const std::string& path)>& resume);

  /// See PeriodicWriter.
  bool is_due() { return writer_.is_due(); }
  void write(Write write) { writer_.write(std::move(write)); }
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
      write_checkpoint(path, state);
    });
  }
  /// Writes what it knows at once, as write_now().
  template <typename Pipeline>
  std::string save(const std::string& path, Pipeline* pipeline) {
    return write_now(path, [pipeline](const std::string& file) {
      const auto state = pipeline->checkpoint();
      if (!state) throw Error("checkpoint: there is nothing to save yet; wait for the first pose");
      write_checkpoint(file, *state);
    });
  }

  /// Adds the entry called `name` to the diagnostics, if there is anything to tell.
  void report(const std::string& name, diagnostic_msgs::DiagnosticArray* array);
  diagnostic_msgs::DiagnosticStatus diagnostic(const std::string& name);
  bool is_used() const { return writer_.is_used(); }

 private:
  Log log_;
  PeriodicWriter writer_;
  std::string start_ = "from nothing";  // how the node started
};

}  // namespace pf_resampling
