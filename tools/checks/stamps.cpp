#include "tools/checks/stamps.hpp"

#include <algorithm>
#include <cmath>

#include "src/messages/input_checks.hpp"

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
  return usable() > 1 && last > first ? static_cast<double>(usable() - 1) / (last - first) : 0.0;
}

void StampCheck::add(const ros::Time& stamp, const ros::Time& bag_time, std::int32_t sender) {
  if (stamp.isZero()) {
    ++zero_;
    return;
  }
  if (check(stamp)) {
    ++impossible_;
    return;
  }
  if (!stamps_.empty() && stamp < latest_) ++out_of_order_;
  latest_ = std::max(latest_, stamp);
  largest_delay_ = std::max(largest_delay_, std::abs(seconds_between(stamp, bag_time)));
  stamps_.emplace_back(stamp, sender);
}

StampSummary StampCheck::summary() const {
  StampSummary summary;
  summary.messages = stamps_.size() + zero_ + impossible_;
  summary.zero = zero_;
  summary.impossible = impossible_;
  summary.out_of_order = out_of_order_;
  summary.largest_delay = largest_delay_;
  if (stamps_.empty()) return summary;

  auto sorted = stamps_;
  std::sort(sorted.begin(), sorted.end());
  summary.first = sorted.front().first.toSec();
  summary.last = sorted.back().first.toSec();
  std::vector<double> periods;
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    if (sorted[i] == sorted[i - 1]) ++summary.twice;
    const double period = seconds_between(sorted[i - 1].first, sorted[i].first);
    if (!(period > 0.0)) continue;
    periods.push_back(period);
    if (period > summary.longest_gap) {
      summary.longest_gap = period;
      summary.longest_gap_at = sorted[i - 1].first.toSec();
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
