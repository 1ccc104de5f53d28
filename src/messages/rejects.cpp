#include "src/messages/rejects.hpp"

#include <algorithm>
#include <tuple>

namespace pf_resampling {

std::string to_string(RejectReason reason) {
  switch (reason) {
    case RejectReason::not_finite:
      return "not_finite";
    case RejectReason::not_positive:
      return "not_positive";
    case RejectReason::impossible_range:
      return "impossible_range";
    case RejectReason::impossible_variance:
      return "impossible_variance";
    case RejectReason::not_unit_quaternion:
      return "not_unit_quaternion";
    case RejectReason::unknown_beacon:
      return "unknown_beacon";
    case RejectReason::unknown_id:
      return "unknown_id";
    case RejectReason::duplicate_beacon:
      return "duplicate_beacon";
    case RejectReason::empty:
      return "empty";
    case RejectReason::wrong_frame:
      return "wrong_frame";
    case RejectReason::unknown_frame:
      return "unknown_frame";
    case RejectReason::no_stamp:
      return "no_stamp";
    case RejectReason::impossible_stamp:
      return "impossible_stamp";
    case RejectReason::out_of_order:
      return "out_of_order";
    case RejectReason::old:
      return "old";
    case RejectReason::before_odometry:
      return "before_odometry";
    case RejectReason::ahead_of_odometry:
      return "ahead_of_odometry";
    case RejectReason::queue_full:
      return "queue_full";
    case RejectReason::overload:
      return "overload";
    case RejectReason::time_jump:
      return "time_jump";
    case RejectReason::time_gap:
      return "time_gap";
    case RejectReason::pose_jump:
      return "pose_jump";
    case RejectReason::ignored:
      return "ignored";
    case RejectReason::gated:
      return "gated";
    case RejectReason::filter_error:
      return "filter_error";
  }
  return "unknown";
}

void RejectCounter::add(const std::string& input, RejectReason reason, const std::string& detail) {
  const auto position = std::lower_bound(counts_.begin(), counts_.end(), std::tie(input, reason),
                                         [](const Count& count, const auto& key) {
                                           return std::tie(count.input, count.reason) < key;
                                         });
  if (position != counts_.end() && position->input == input && position->reason == reason) {
    ++position->count;
    position->latest = detail;
  } else {
    counts_.insert(position, {input, reason, 1, detail});
  }
}

std::uint64_t RejectCounter::count(const std::string& input, RejectReason reason) const {
  for (const Count& count : counts_) {
    if (count.input == input && count.reason == reason) return count.count;
  }
  return 0;
}

std::uint64_t RejectCounter::total() const {
  std::uint64_t total = 0;
  for (const Count& count : counts_) total += count.count;
  return total;
}

}  // namespace pf_resampling
