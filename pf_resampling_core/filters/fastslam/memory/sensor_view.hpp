#pragma once

#include <Eigen/Core>

namespace pf_resampling {

/// How far and how wide a sensor sees, learnt from what it has seen: a high quantile of range and
/// bearing, by stochastic approximation (Robbins and Monro, 1951). A wild reading widens it by
/// little, and not for long.
struct SensorView {
  double range = 0.0;    ///< m
  double bearing = 0.0;  ///< rad, to both sides

  void add(double seen_range, double seen_bearing);
  double reach() const;  ///< m, from where on a landmark may be out of view
  /// Whether it should see what is at `place` (sensor frame, m): well within, off the rim.
  bool covers(const Eigen::Vector2d& place) const;
};

}  // namespace pf_resampling
