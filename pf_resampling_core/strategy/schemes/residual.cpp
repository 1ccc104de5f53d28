#include <algorithm>

#include "pf_resampling_core/strategy/schemes/schemes.hpp"
#include "pf_resampling_core/strategy/schemes/sorted_draws.hpp"

namespace pf_resampling {
namespace {

PF_RESAMPLING_VECTOR_CLONES
int take_whole_copies(const ScaledWeights& weights, int* counts) {
  std::int64_t scaled[kBlock];
  int taken = 0;
  for (std::int64_t begin = 0; begin < weights.size; begin += kBlock) {
    const std::int64_t size = std::min(kBlock, weights.size - begin);
    weights.block(begin, size, scaled);
    for (std::int64_t i = 0; i < size; ++i) {
      const int whole =
          static_cast<int>(static_cast<std::uint64_t>(scaled[i]) >> weights.fraction_bits);
      counts[begin + i] = whole;
      taken += whole;
    }
  }
  return taken;
}

}  // namespace

// Mahmoud section II.B (Liu and Chen 1998): the whole copies of M w, then multinomial draws from
// what is left over. A peer takes for these the smallest of M sorted uniforms, and so favours the
// first particles; here the number left over is drawn anew over the whole of the left-overs.
void residual(const ScaledWeights& weights, const ResamplingOptions&, const RandomStream& stream,
              ResamplingWorkspace* work, int* counts) {
  reserve_sorted_draws(weights.copies, weights.copies, work);
  const int left_over = weights.copies - take_whole_copies(weights, counts);
  if (left_over == 0) return;
  sorted_draws(stream, 0, left_over, left_over, weights.fraction_bits, work);
  add_draws(weights, weights.one() - 1, *work, counts);
}

}  // namespace pf_resampling
