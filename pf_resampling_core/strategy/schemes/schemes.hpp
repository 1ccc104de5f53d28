#pragma once

#include <cstdint>

#include "pf_resampling_core/strategy/resampling.hpp"
#include "pf_resampling_core/strategy/schemes/scaled_weights.hpp"

/// The schemes: each writes how often every particle is taken, counts[0 .. weights.size), sum
/// weights.copies. All in exact integers, see ScaledWeights.
namespace pf_resampling {

// With one uniform in (0, 1), the offset of the thresholds in units of their distance: what the
// papers call U is uniform / M. These three give the same counts.
void systematic(const ScaledWeights& weights, double uniform, int* counts);
void residual_systematic(const ScaledWeights& weights, double uniform, int* counts);
void residual_then_systematic(const ScaledWeights& weights, double uniform, int* counts);

// With many draws from the stream.
void multinomial(const ScaledWeights& weights, const RandomStream& stream,
                 ResamplingWorkspace* work, int* counts);
void residual(const ScaledWeights& weights, const RandomStream& stream, ResamplingWorkspace* work,
              int* counts);
void stratified(const ScaledWeights& weights, const RandomStream& stream, ResamplingWorkspace* work,
                int* counts);
void ssp(const ScaledWeights& weights, const RandomStream& stream, ResamplingWorkspace* work,
         int* counts);
void killing(const ScaledWeights& weights, const RandomStream& stream, ResamplingWorkspace* work,
             int* counts);

/// Any of the above, by name; not `partial` or `rank_based`.
void draw_counts(ResamplingScheme scheme, const ScaledWeights& weights, const RandomStream& stream,
                 ResamplingWorkspace* work, int* counts);

// The two that choose who takes part, or with which probability, and leave the draw to
// options.inner_scheme.
struct SharedMass {
  double mass = 0.0;  ///< S_hl, of those that took part in `partial`
  int particles = 0;
};
SharedMass partial(const ScaledWeights& weights, const ResamplingOptions& options,
                   const RandomStream& stream, ResamplingWorkspace* work, int* counts);
void rank_based(const ScaledWeights& weights, const ResamplingOptions& options,
                const RandomStream& stream, ResamplingWorkspace* work, int* counts);

/// Log-weights that make the selection by the two above unbiased, for WeightsAfter::unbiased: to be
/// called right after them, with the same working space. log_weights[0 .. size) per slot.
void log_weights_after_partial(const ScaledWeights& weights, const SharedMass& shared,
                               ResamplingWorkspace* work, const int* ancestors, int size,
                               double* log_weights);
void log_weights_after_rank_based(const ScaledWeights& weights, ResamplingWorkspace* work,
                                  const int* ancestors, int size, double* log_weights);

}  // namespace pf_resampling
