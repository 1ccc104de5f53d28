#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace pf_resampling {

/// A bar on stderr that shows how far long work has come and how long it will take; when stderr is
/// not a terminal, a line after 10 s, and one every 30 s from then on.
class ProgressBar {
 public:
  /// `total`: amount of work, in the unit of update().
  ProgressBar(std::string label, std::uint64_t total);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// Says that `done` of the total is done. Cheap: draws only when the percentage changes.
  void update(std::uint64_t done);

  /// Removes the bar from the terminal; the destructor does it too.
  void finish();

 private:
  std::string label_;
  std::uint64_t total_;
  int drawn_percent_ = -1;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  bool is_terminal_;
  double next_line_ = 10.0;  // s since the start
};

}  // namespace pf_resampling
