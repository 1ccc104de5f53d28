#include "src/messages/rejects.hpp"

#include <algorithm>
#include <tuple>

#include "pf_resampling_core/files/text_file.hpp"

namespace pf_resampling {

const EnumNames<RejectReason>& names_of(RejectReason) {
  using Reason = RejectReason;
  static const EnumNames<RejectReason> names("reason",
                                             {{Reason::not_finite, "not_finite"},
                                              {Reason::not_positive, "not_positive"},
                                              {Reason::impossible_range, "impossible_range"},
                                              {Reason::impossible_position, "impossible_position"},
                                              {Reason::impossible_variance, "impossible_variance"},
                                              {Reason::not_unit_quaternion, "not_unit_quaternion"},
                                              {Reason::unknown_beacon, "unknown_beacon"},
                                              {Reason::unknown_id, "unknown_id"},
                                              {Reason::duplicate_beacon, "duplicate_beacon"},
                                              {Reason::empty, "empty"},
                                              {Reason::too_many, "too_many"},
                                              {Reason::wrong_frame, "wrong_frame"},
                                              {Reason::unknown_frame, "unknown_frame"},
                                              {Reason::no_stamp, "no_stamp"},
                                              {Reason::impossible_stamp, "impossible_stamp"},
                                              {Reason::out_of_order, "out_of_order"},
                                              {Reason::repeated, "repeated"},
                                              {Reason::old, "old"},
                                              {Reason::before_odometry, "before_odometry"},
                                              {Reason::ahead_of_odometry, "ahead_of_odometry"},
                                              {Reason::queue_full, "queue_full"},
                                              {Reason::overload, "overload"},
                                              {Reason::time_jump, "time_jump"},
                                              {Reason::time_gap, "time_gap"},
                                              {Reason::pose_jump, "pose_jump"},
                                              {Reason::ignored, "ignored"},
                                              {Reason::filter_error, "filter_error"},
                                              {Reason::unreadable, "unreadable"},
                                              {Reason::exception, "exception"}});
  return names;
}

std::string shown_detail(const std::string& detail) {
  constexpr std::size_t kShown = 1000;
  const std::string shown = text_file::in_letters(detail.substr(0, kShown));
  return detail.size() > kShown ? shown + "..." : shown;
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

std::vector<std::string> lines_of(const RejectCounter& rejects) {
  std::vector<std::string> lines;
  for (const RejectCounter::Count& count : rejects.counts()) {
    lines.push_back(std::to_string(count.count) + " " + count.input + " rejected, " +
                    to_string(count.reason) + ": " + count.latest);
  }
  return lines;
}

}  // namespace pf_resampling
