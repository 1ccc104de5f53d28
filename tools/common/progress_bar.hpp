#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace pf_resampling {

/// A line on stderr, where that is a terminal, that shows how far long work has come and how long
/// it will take.
class ProgressBar {
 public:
  /// `total`: amount of work, in the unit of update().
  ProgressBar(std::string label, std::uint64_t total);
  /// Removes the line.
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// Says that `done` of the total is done. Cheap: draws only when the percentage changes.
  void update(std::uint64_t done);

 private:
  std::string label_;
  std::uint64_t total_;
  bool is_terminal_;
  int drawn_percent_ = -1;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace pf_resampling
