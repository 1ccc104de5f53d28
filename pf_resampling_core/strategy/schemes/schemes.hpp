#pragma once

#include "pf_resampling_core/strategy/resampling.hpp"
#include "pf_resampling_core/strategy/schemes/scaled_weights.hpp"

/// What a resampling scheme is: a function that writes how often every particle is taken,
/// counts[0 .. weights.size), sum weights.copies. All in exact integers, see ScaledWeights. Each
/// has a file of its own here and a line in the table of resampling.cpp.
namespace pf_resampling {

using DrawCounts = void(const ScaledWeights& weights, const ResamplingOptions& options,
                        const RandomStream& stream, ResamplingWorkspace* work, int* counts);

/// Log-weights that make the selection by a scheme unbiased that selects with probabilities other
/// than the weights, for WeightsAfter::unbiased: called right after it, with the same working
/// space. log_weights[0 .. size) per slot.
using LogWeightsAfter = void(const ScaledWeights& weights, ResamplingWorkspace* work,
                             const int* ancestors, int size, double* log_weights);

/// With one uniform in (0, 1), the offset of the thresholds in units of their distance: what the
/// papers call U is uniform / M.
void systematic(const ScaledWeights& weights, double uniform, int* counts);

/// For schemes that choose who takes part, or with which probability, and leave the draw to
/// options.inner_scheme.
DrawCounts draw_inner_counts;

}  // namespace pf_resampling
