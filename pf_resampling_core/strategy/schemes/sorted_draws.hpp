#pragma once

#include "pf_resampling_core/strategy/schemes/schemes.hpp"

namespace pf_resampling {

/// Room that sorted_draws() needs for `draws` among `copies`, so that a first call makes it for all
/// later ones.
void reserve_sorted_draws(std::int64_t draws, int copies, ResamplingWorkspace* work);

/// `draws` independent uniforms in [0, copies · 2^fraction_bits), in ascending order, from uniforms
/// number `first` to first + draws of the stream, into work->thresholds. O(draws), no sorting.
void sorted_draws(const RandomStream& stream, std::uint64_t first, int draws, int copies,
                  int fraction_bits, ResamplingWorkspace* work);

/// Adds to counts[k] the number of sorted draws that fall into particle k's part of the running
/// sum of (scaled weight & mask). The parts must add up to the range of the draws.
void add_draws(const ScaledWeights& weights, std::int64_t mask, const ResamplingWorkspace& work,
               int* counts);

}  // namespace pf_resampling
