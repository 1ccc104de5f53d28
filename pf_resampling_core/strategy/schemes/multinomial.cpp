#include <algorithm>

#include "pf_resampling_core/strategy/schemes/schemes.hpp"
#include "pf_resampling_core/strategy/schemes/sorted_draws.hpp"

namespace pf_resampling {

// Mahmoud section II.A: M independent draws. Drawn in ascending order as exponential spacings
// (Devroye 1986, chapter V.3), so that one pass over the running sum finds them all.
void multinomial(const ScaledWeights& weights, const ResamplingOptions&, const RandomStream& stream,
                 ResamplingWorkspace* work, int* counts) {
  sorted_draws(stream, 0, weights.copies, weights.copies, weights.fraction_bits, work);
  std::fill(counts, counts + weights.size, 0);
  add_draws(weights, ~std::int64_t{0}, *work, counts);
}

}  // namespace pf_resampling
