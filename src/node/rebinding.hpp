#pragma once

#include <algorithm>
#include <chrono>
#include <utility>

namespace pf_resampling {

/// When an input that takes messages of any type is to be subscribed to anew. roscpp binds such a
/// subscriber to the type of the first publisher that it meets, and refuses all others from then
/// on, even when that one is gone: whoever came first by mistake would keep the right one out.
class Rebinding {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kPatience{10}, kMostPatience{160};

  /// `is_expected`: it is of a type that the input knows.
  void note_message(bool is_expected, Clock::time_point now) {
    is_bound_ = true;
    last_ = now;
    if (is_expected) patience_ = kPatience;
    is_wrong_ = is_wrong_ || !is_expected;
  }

  /// Whether it is: after a message of a type that is not known; and when nothing comes although it
  /// has met somebody, ever more rarely, for a message that comes at that moment is lost.
  /// `publishers`: how many it is connected to. To be asked every second.
  bool is_due(unsigned publishers, Clock::time_point now) {
    if (publishers > 0 && !std::exchange(is_bound_, true)) last_ = now;
    const bool is_silent = is_bound_ && now - last_ >= patience_;
    if (!std::exchange(is_wrong_, false) && !is_silent) return false;
    if (is_silent) patience_ = std::min(2 * patience_, kMostPatience);
    is_bound_ = false;
    return true;
  }

 private:
  std::chrono::seconds patience_ = kPatience;
  bool is_bound_ = false, is_wrong_ = false;
  Clock::time_point last_;  // when it was bound, or the latest message came
};

}  // namespace pf_resampling
