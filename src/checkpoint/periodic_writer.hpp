#pragma once

#include <diagnostic_msgs/DiagnosticStatus.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <string>

#include "src/diagnostics/log_level.hpp"

namespace pf_resampling {

/// Writes a file anew from time to time, in a thread of its own, so that nobody waits for the disk.
class PeriodicWriter {
 public:
  /// Writes what it holds to the file of this name. Throws Error when that cannot be.
  using Write = std::function<void(const std::string& path)>;
  using Log = std::function<void(LogLevel, const std::string&)>;

  /// `file`: empty: none is written. `period`: s, of the wall clock. What cannot be written is told
  /// to `log`.
  PeriodicWriter(std::string file, double period, Log log)
      : file_(std::move(file)), period_(period), log_(std::move(log)), last_(Clock::now()) {}
  /// Waits for what is being written.
  ~PeriodicWriter();
  PeriodicWriter(const PeriodicWriter&) = delete;
  PeriodicWriter& operator=(const PeriodicWriter&) = delete;

  bool is_used() const { return !file_.empty(); }
  const std::string& file() const { return file_; }

  /// Whether it should be written again: the period has gone by, and the last is done.
  bool is_due();
  /// Has it written by a thread of its own, which `write` has to be fit for.
  void write(Write write);
  /// Writes at once, to another file if one is given. Throws what `write` does.
  void write_now(const Write& write, const std::string& other_file = "");

  /// What went wrong, last and not yet put right by a file that was written; empty if nothing did.
  /// Of the start of the node, whoever starts it says so.
  void note_problem(const std::string& problem) { problem_ = problem; }

  /// Adds what it has written, and a warning if there is a problem.
  void report(const std::string& started, diagnostic_msgs::DiagnosticStatus* status);

 private:
  using Clock = std::chrono::steady_clock;

  void take_result(bool wait);

  std::string file_;
  double period_;
  Log log_;
  Clock::time_point last_;            // when the last was begun
  std::future<std::string> writing_;  // what went wrong; empty if nothing did
  std::string problem_;
  std::uint64_t written_ = 0, failed_ = 0;
};

}  // namespace pf_resampling
