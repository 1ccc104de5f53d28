#include "tools/checks/units.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace pf_resampling {
namespace {

constexpr double kSameMoment = 0.5;  // s
constexpr std::size_t kFewestPairs = 20;
// Shares of the pairs that do not fit: no unit is to have more, the beacons' own to have more.
constexpr double kFits = 0.1;
constexpr double kDoesNotFit = 0.2;
// What a sum or a difference may be off by, of the distance.
constexpr double kSlack = 0.1;

struct Unit {
  double scale;  // of the ranges
  RangeUnit words;
};
const std::array<Unit, 7> kUnits = {
    {{1.0, {}},
     {1000.0, {"1000 times too long", "ranges were in millimetres"}},
     {100.0, {"100 times too long", "ranges were in centimetres"}},
     {1.0 / 0.3048, {"3.3 times too long", "ranges were in feet"}},
     {0.001, {"1000 times too short", "the beacons were in millimetres"}},
     {0.01, {"100 times too short", "the beacons were in centimetres"}},
     {0.3048, {"3.3 times too short", "the beacons were in feet"}}}};

// Pieces of way and turn that tell something.
constexpr double kPiece = 0.05;                     // m
constexpr double kLeastCourse = 0.5 * kPi / 180.0;  // rad
constexpr std::size_t kFewestTurns = 20;

}  // namespace

std::optional<RangeUnit> unit_of_ranges(
    const std::vector<TimedRange>& ranges,
    const std::map<std::int32_t, geometry_msgs::Point>& beacons) {
  std::array<std::size_t, kUnits.size()> misfits{};
  std::size_t pairs = 0;
  for (std::size_t i = 1; i < ranges.size(); ++i) {
    const TimedRange& a = ranges[i - 1];
    const TimedRange& b = ranges[i];
    const auto first = beacons.find(a.beacon);
    const auto second = beacons.find(b.beacon);
    if (first == beacons.end() || second == beacons.end()) continue;
    const double distance =
        std::hypot(first->second.x - second->second.x, first->second.y - second->second.y);
    if (!(distance > 0.0) || std::abs(a.time - b.time) > kSameMoment) continue;
    ++pairs;
    for (std::size_t k = 0; k < kUnits.size(); ++k) {
      const double scale = kUnits[k].scale;
      const bool fits = (a.range + b.range) / scale >= (1.0 - kSlack) * distance &&
                        std::abs(a.range - b.range) / scale <= (1.0 + kSlack) * distance;
      if (!fits) ++misfits[k];
    }
  }
  if (pairs < kFewestPairs) return std::nullopt;
  const auto share = [&](std::size_t k) {
    return static_cast<double>(misfits[k]) / static_cast<double>(pairs);
  };
  const auto best =
      static_cast<std::size_t>(std::min_element(misfits.begin(), misfits.end()) - misfits.begin());
  if (share(0) < kDoesNotFit || share(best) > kFits) return std::nullopt;
  // Ranges that are all alike, of a robot that stands, fit each unit that makes them long enough.
  for (std::size_t k = 0; k < kUnits.size(); ++k) {
    if (k != best && share(k) <= kFits) return std::nullopt;
  }
  return kUnits[best].words;
}

void TurnComparison::add(const Pose2& pose) {
  if (!last_) last_ = pose;
  const double x = pose.x - last_->x;
  const double y = pose.y - last_->y;
  if (!(std::hypot(x, y) >= kPiece)) return;
  const double course = std::atan2(y, x);
  if (course_) {
    const double turn = wrap_angle(course - *course_);
    if (std::abs(turn) > kLeastCourse && std::abs(turn) < kPi / 60.0) {
      ratios_.push_back(wrap_angle(pose.heading - *heading_) / turn);
    }
  }
  course_ = course;
  heading_ = pose.heading;
  last_ = pose;
}

bool TurnComparison::in_degrees() const {
  if (ratios_.size() < kFewestTurns) return false;
  std::vector<double> sorted = ratios_;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  return *middle > 30.0 && *middle < 90.0;
}

}  // namespace pf_resampling
