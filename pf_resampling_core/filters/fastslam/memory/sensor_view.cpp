#include "pf_resampling_core/filters/fastslam/memory/sensor_view.hpp"

#include <algorithm>
#include <cmath>

#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {
namespace {

// By how much a sighting beyond it widens the view at most, and one within it narrows it: no wider
// in the end if up to one sighting in 150 is wild.
constexpr double kWidens = 0.05;
constexpr double kNarrows = 0.0003;
// Well within: a share of the range, rad, and m across.
constexpr double kInsideRange = 0.93;
constexpr double kInsideBearing = 0.03;
constexpr double kInsideAcross = 0.2;

double approached(double quantile, double value) {
  if (quantile == 0.0) return value;
  return value > quantile ? std::min(value, (1.0 + kWidens) * quantile)
                          : (1.0 - kNarrows) * quantile;
}

}  // namespace

void SensorView::add(double seen_range, double seen_bearing) {
  range = approached(range, seen_range);
  bearing = approached(bearing, std::abs(wrap_angle(seen_bearing)));
}

double SensorView::reach() const {
  return kInsideRange * range;
}

bool SensorView::covers(const Eigen::Vector2d& place) const {
  const double distance = place.norm();
  const double widest = bearing - kInsideBearing - kInsideAcross / distance;
  return distance < reach() && std::abs(std::atan2(place.y(), place.x())) < widest;
}

}  // namespace pf_resampling
