#include "pf_resampling_core/strategy/schemes/schemes.hpp"
#include "pf_resampling_core/strategy/schemes/sorted_draws.hpp"

namespace pf_resampling {
namespace {

// Particle k lives with probability w_k / max w.
PF_RESAMPLING_VECTOR_CLONES
int mark_survivors(const ScaledWeights& weights, const double* uniforms, int* counts) {
  const double largest = weights.weights[weights.largest];
  int survivors = 0;
  for (std::int64_t i = 0; i < weights.size; ++i) {
    const int lives = uniforms[i] * largest < weights.weights[i] ? 1 : 0;
    counts[i] = lives;
    survivors += lives;
  }
  return survivors;
}

}  // namespace

// Killing (Del Moral, "Feynman-Kac formulae", 2004; as in Gerber, Chopin and Whiteley 2019): a
// particle keeps its slot with probability w_k / max w, and every slot that falls free is filled by
// an independent draw. E[count_k] = w_k / max w + (M - sum w / max w) w_k = M w_k needs M = N.
void killing(const ScaledWeights& weights, const ResamplingOptions&, const RandomStream& stream,
             ResamplingWorkspace* work, int* counts) {
  reserve_sorted_draws(weights.copies, weights.copies, work);
  double* uniforms = grow(&work->uniforms, weights.size);
  stream.fill_uniform(0, weights.size, uniforms);
  const int dead = weights.copies - mark_survivors(weights, uniforms, counts);
  if (dead == 0) return;
  sorted_draws(stream, static_cast<std::uint64_t>(weights.size), dead, weights.copies,
               weights.fraction_bits, work);
  add_draws(weights, ~std::int64_t{0}, *work, counts);
}

}  // namespace pf_resampling
