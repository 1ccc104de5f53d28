#pragma once

#include <ros/time.h>

#include <cstddef>
#include <vector>

namespace pf_resampling {

/// What the stamps of a topic are like.
struct StampSummary {
  std::size_t messages = 0;
  double first = 0.0;           ///< s, the earliest
  double last = 0.0;            ///< s, the latest
  double median_period = 0.0;   ///< s, between neighbouring stamps that differ
  double longest_gap = 0.0;     ///< s
  double longest_gap_at = 0.0;  ///< s, when it begins
  std::size_t gaps = 0;         ///< periods of more than kGapFactor times the median
  double largest_delay = 0.0;   ///< s, largest |bag time - stamp|

  /// Mean rate in Hz; 0 for fewer than two of them.
  double rate() const;
};

/// Periods longer than this many median ones are gaps.
inline constexpr double kGapFactor = 5.0;

/// Gathers the stamps of a topic that filters do not reject as none.
class StampCheck {
 public:
  void add(const ros::Time& stamp, const ros::Time& bag_time);

  StampSummary summary() const;

 private:
  std::vector<ros::Time> stamps_;
  double largest_delay_ = 0.0;
};

}  // namespace pf_resampling
