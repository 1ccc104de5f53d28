#include <algorithm>

#include "pf_resampling_core/strategy/schemes/schemes.hpp"

namespace pf_resampling {

// Mahmoud section II.D, its "residual systematic resampling": the whole copies of M w, then
// systematic resampling of what is left over.
//
// Mahmoud's listing forgets the floor in `r = w M`, so that nothing would be left over, and its
// last loop must add, `r = r + rr`, where it doubles r. Normalising the left-overs and asking for
// M_r copies gives them the width they have already, in copies. The running sum differs from
// systematic()'s by whole copies only, so for the same uniform the counts are equal.
PF_RESAMPLING_VECTOR_CLONES
void residual_then_systematic(const ScaledWeights& weights, double uniform, int* counts) {
  const int bits = weights.fraction_bits;
  const std::int64_t one = weights.one();
  const std::int64_t shift =
      one - 1 - static_cast<std::int64_t>(uniform * static_cast<double>(one));
  std::int64_t scaled[kBlock];
  std::int64_t running[kBlock + 1];
  running[0] = shift;
  for (std::int64_t begin = 0; begin < weights.size; begin += kBlock) {
    const std::int64_t size = std::min(kBlock, weights.size - begin);
    weights.block(begin, size, scaled);
    for (std::int64_t i = 0; i < size; ++i) running[i + 1] = running[i] + (scaled[i] & (one - 1));
    for (std::int64_t i = 0; i < size; ++i) {
      const std::uint64_t whole = static_cast<std::uint64_t>(scaled[i]) >> bits;
      const std::uint64_t before = static_cast<std::uint64_t>(running[i]) >> bits;
      const std::uint64_t after = static_cast<std::uint64_t>(running[i + 1]) >> bits;
      counts[begin + i] = static_cast<int>(whole + (after - before));
    }
    running[0] = running[size];
  }
}

}  // namespace pf_resampling
