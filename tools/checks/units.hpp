#pragma once

#include <geometry_msgs/Point.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {

/// A range to a beacon as it came.
struct TimedRange {
  double time = 0.0;  ///< s
  std::int32_t beacon = 0;
  double range = 0.0;
};

/// A unit that ranges seem to have.
struct RangeUnit {
  std::string times;  ///< "1000 times too long"
  std::string as_if;  ///< "they were in mm"
};

/// What ranges would have to be in to fit the beacons' places: with the distance d between two
/// beacons, ranges of the same moment have a sum of at least d and a difference of at most d.
/// Nothing if that is the beacons' unit, or nothing fits much better.
std::optional<RangeUnit> unit_of_ranges(
    const std::vector<TimedRange>& ranges,
    const std::map<std::int32_t, geometry_msgs::Point>& beacons);

/// How much odometry turns, beside how much its way does.
class TurnComparison {
 public:
  void add(const Pose2& pose);
  /// Whether that is as if a heading in degrees was taken as one in radians.
  bool in_degrees() const;

 private:
  std::optional<Pose2> last_;
  std::optional<double> course_, heading_;  // of the last piece of the way, rad
  std::vector<double> ratios_;
};

}  // namespace pf_resampling
