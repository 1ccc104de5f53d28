#include "tools/checks/stamps.hpp"

#include <algorithm>
#include <cmath>

#include "src/odometry/input_checks.hpp"

namespace pf_resampling {
namespace {

/// From a to b, in s. (ROS throws where its difference of times has no room for it.)
double seconds_between(const ros::Time& a, const ros::Time& b) {
  const auto nanoseconds =
      static_cast<std::int64_t>(b.toNSec()) - static_cast<std::int64_t>(a.toNSec());
  return static_cast<double>(nanoseconds) / 1e9;
}

}  // namespace

double StampSummary::rate() const {
  return messages > 1 && last > first ? static_cast<double>(messages - 1) / (last - first) : 0.0;
}

void StampCheck::add(const ros::Time& stamp, const ros::Time& bag_time) {
  if (check(stamp)) return;
  largest_delay_ = std::max(largest_delay_, std::abs(seconds_between(stamp, bag_time)));
  stamps_.push_back(stamp);
}

StampSummary StampCheck::summary() const {
  StampSummary summary;
  summary.messages = stamps_.size();
  summary.largest_delay = largest_delay_;
  if (stamps_.empty()) return summary;

  auto sorted = stamps_;
  std::sort(sorted.begin(), sorted.end());
  summary.first = sorted.front().toSec();
  summary.last = sorted.back().toSec();
  std::vector<double> periods;
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    const double period = seconds_between(sorted[i - 1], sorted[i]);
    if (!(period > 0.0)) continue;
    periods.push_back(period);
    if (period > summary.longest_gap) {
      summary.longest_gap = period;
      summary.longest_gap_at = sorted[i - 1].toSec();
    }
  }
  if (periods.empty()) return summary;
  const auto middle = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
  std::nth_element(periods.begin(), middle, periods.end());
  summary.median_period = *middle;
  summary.gaps =
      static_cast<std::size_t>(std::count_if(periods.begin(), periods.end(), [&](double period) {
        return period > kGapFactor * summary.median_period;
      }));
  return summary;
}

}  // namespace pf_resampling
