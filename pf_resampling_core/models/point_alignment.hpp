#pragma once

#include <Eigen/Core>
#include <vector>

#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {

/// The turn and shift T that bring points nearest to their partners: T from[i] ~ to[i], least
/// squares, in closed form (Umeyama 1991, in the plane, without scale). A single pair, or points
/// that coincide, are shifted only. Throws Error on different sizes or no points.
Pose2 align_points(const std::vector<Eigen::Vector2d>& from,
                   const std::vector<Eigen::Vector2d>& to);

}  // namespace pf_resampling
