#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {

/// A population that comes from outside a filter.
struct GivenParticles {
  std::vector<Pose2> poses;     ///< m, rad, map frame
  std::vector<double> weights;  ///< as many, none negative, of any scale; empty: all alike
};

/// m: no position is beyond, in x or y.
constexpr double kFarthestPosition = 1e9;

/// Whether a pose is finite, and no farther than that.
bool is_in_reach(const Pose2& pose);

/// So many can be given at most.
constexpr std::size_t kMostGivenParticles = 1000000;

/// Throws Error, in one line that names particle, value and remedy, for what is no population: none
/// or too many, other than finite poses within 1e9 m, weights that are too few or too many, not
/// finite, negative, or all zero.
void check_given_particles(const GivenParticles& particles);

/// Logarithms of their weights, of which the largest is 0; minus infinity for a weight of zero. Of
/// checked particles.
Eigen::ArrayXd log_weights_of(const GivenParticles& particles);

}  // namespace pf_resampling
