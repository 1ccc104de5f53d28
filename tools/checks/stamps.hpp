#pragma once

#include <ros/time.h>

#include <cstdint>
#include <utility>
#include <vector>

namespace pf_resampling {

/// What the stamps of a topic are like.
struct StampSummary {
  std::size_t messages = 0;
  std::size_t zero = 0;          ///< stamps that are zero, "no time"; not counted below
  std::size_t impossible = 0;    ///< those that ROS cannot reckon with; not counted below
  double first = 0.0;            ///< s, the earliest
  double last = 0.0;             ///< s, the latest
  double median_period = 0.0;    ///< s, between neighbouring stamps that differ
  double longest_gap = 0.0;      ///< s
  double longest_gap_at = 0.0;   ///< s, when it begins
  std::size_t gaps = 0;          ///< periods of more than kGapFactor times the median
  std::size_t out_of_order = 0;  ///< stamps before one that came earlier in the bag
  std::size_t twice = 0;         ///< stamps that were there already (for the same sender)
  double largest_delay = 0.0;    ///< s, largest |bag time - stamp|

  /// How many stamps can be used: neither zero nor impossible.
  std::size_t usable() const { return messages - zero - impossible; }
  /// Mean rate in Hz; 0 for fewer than two of them.
  double rate() const;
};

/// Periods longer than this many median ones are gaps.
inline constexpr double kGapFactor = 5.0;

/// Gathers the stamps of a topic in the order of the bag.
class StampCheck {
 public:
  /// `sender`: stamps count as twice the same only for the same one, for instance the same beacon.
  void add(const ros::Time& stamp, const ros::Time& bag_time, std::int32_t sender = 0);

  StampSummary summary() const;

 private:
  std::vector<std::pair<ros::Time, std::int32_t>> stamps_;
  std::size_t zero_ = 0;
  std::size_t impossible_ = 0;
  std::size_t out_of_order_ = 0;
  ros::Time latest_;
  double largest_delay_ = 0.0;
};

}  // namespace pf_resampling
