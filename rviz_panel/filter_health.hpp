#pragma once

#include <pf_resampling/FilterStatus.h>

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "src/diagnostics/diagnostics.hpp"

namespace pf_resampling {

/// What the messages on `status` of the last minute say, as a curve and in words.
class FilterHealth {
 public:
  enum class Level { unknown, good, warning, bad };
  struct Verdict {
    Level level = Level::unknown;
    std::string text;
  };

  void add(const FilterStatus& status);
  void clear();

  const std::optional<FilterStatus>& latest() const { return latest_; }

  /// Of the last minute, in the order in which it came.
  struct SampleSize {
    double time;   ///< s
    double share;  ///< N_eff / particles
    bool renewed;
  };
  const std::deque<SampleSize>& sample_sizes() const { return sample_sizes_; }

  /// Whether the filter can be believed, and if not, why not: as the node judges it.
  Verdict verdict() const;
  /// What has changed, or is wrong, a line each, the latest first; empty: nothing.
  std::string findings_text() const;
  std::string sample_size_text() const;
  /// Particles, landmarks, updates, ancestors, the probability of being lost, time of an update.
  std::string counts_text() const;
  /// "ranges: unknown beacon 12": how often each was since the node started, the most first.
  std::vector<std::string> rejects() const;

 private:
  std::optional<FilterStatus> latest_;
  std::deque<SampleSize> sample_sizes_;
  UpdateTiming timing_;
};

/// "0.30 ms", "12 ms", "1.5 s".
std::string duration_text(double seconds);

/// "62 %", "0.4 %".
std::string percent_text(double share);

}  // namespace pf_resampling
