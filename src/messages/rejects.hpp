#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pf_resampling_core/parameters/enum_names.hpp"

namespace pf_resampling {

/// Why a message, or an observation in it, was not used.
enum class RejectReason {
  not_finite,           ///< NaN or infinite number
  not_positive,         ///< a range of zero or less
  impossible_range,     ///< beyond a thousand kilometres
  impossible_position,  ///< beyond a million kilometres
  impossible_variance,  ///< negative, or so large or small, or a covariance, that none can have
  not_unit_quaternion,
  unknown_beacon,     ///< id that is not among the beacons
  unknown_id,         ///< a landmark without id where the others have one
  duplicate_beacon,   ///< an id twice in one array
  empty,              ///< an array without elements
  too_many,           ///< more of something than a parameter allows
  wrong_frame,        ///< frame other than the configured one
  unknown_frame,      ///< no transform from the base frame
  no_stamp,           ///< stamp zero
  impossible_stamp,   ///< of 2038 or later, or with a second of nanoseconds or more
  out_of_order,       ///< odometry not newer than the last
  repeated,           ///< an observation that came before, as it is
  old,                ///< observation before what the filter has already used
  before_odometry,    ///< observation before the first odometry
  ahead_of_odometry,  ///< observation too far ahead of the newest odometry
  queue_full,         ///< dropped because too many observations wait
  overload,           ///< dropped because computation does not keep up
  time_jump,          ///< odometry whose time jumped, not confirmed yet
  time_gap,           ///< odometry after a long silence, not confirmed yet
  pose_jump,          ///< odometry that moved faster than the robot can
  ignored,            ///< beacons that differ from the configured ones
  filter_error,       ///< the filter refused it
  unreadable,         ///< of a type that is not known, or not as its definition says
  exception,          ///< something failed that should not: memory, or a fault of the program
};
const EnumNames<RejectReason>& names_of(RejectReason);

/// Why a message cannot be used, with the values, and the remedy where there is one.
struct Rejection {
  RejectReason reason;
  std::string detail;
};

/// What is said of a message or request, which may hold anything: one line, without what a terminal
/// takes for commands, and the beginning of one that has no end.
std::string shown_detail(const std::string& detail);

/// Counts what was rejected, by input and reason, and keeps the latest case in words.
class RejectCounter {
 public:
  struct Count {
    std::string input;  ///< topic without slash: "ranges", "odom", ...
    RejectReason reason = RejectReason::not_finite;
    std::uint64_t count = 0;
    std::string latest;  ///< the latest case, in words: what was wrong, and the remedy
  };

  /// Adds one. `detail` says what was wrong with this one; it may be empty.
  void add(const std::string& input, RejectReason reason, const std::string& detail);

  /// All counts above zero, sorted by input and reason.
  const std::vector<Count>& counts() const { return counts_; }

  std::uint64_t count(const std::string& input, RejectReason reason) const;
  std::uint64_t total() const;

 private:
  std::vector<Count> counts_;
};

/// A line for each count: "12 ranges rejected, unknown_beacon: beacon 7 is unknown; known are 1".
std::vector<std::string> lines_of(const RejectCounter& rejects);

}  // namespace pf_resampling
