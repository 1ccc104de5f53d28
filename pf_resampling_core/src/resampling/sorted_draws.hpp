#pragma once

#include "schemes.hpp"

namespace pf_resampling {

/// Room that sorted_draws() needs for `draws`, so that a first call makes it for all later ones.
void reserve_sorted_draws(std::int64_t draws, ResamplingWorkspace* work);

/// `draws` independent uniforms in [0, total), in ascending order, from uniforms number `first` to
/// first + draws of the stream, in work->thresholds. O(draws), no sorting.
void sorted_draws(const RandomStream& stream, std::uint64_t first, std::int64_t draws,
                  std::int64_t total, ResamplingWorkspace* work);

/// Adds to counts[k] the number of sorted draws that fall into particle k's part of the running
/// sum of (scaled weight & mask). The parts must add up to the `total` of the draws.
void add_draws(const ScaledWeights& weights, std::int64_t mask, std::int64_t draws,
               const ResamplingWorkspace& work, int* counts);

}  // namespace pf_resampling
