#include <algorithm>

#include "pf_resampling_core/strategy/schemes/schemes.hpp"

namespace pf_resampling {

// Kwak Table I, Mahmoud section II.C: the thresholds u + k/M on the running sum of the weights.
//
// Kwak's listing counts by `U = U + 1/M` in a while loop, whose rounding loses a particle from
// about 1e5 on in single precision; Mahmoud prints no listing. Here the thresholds up to the
// running sum s are counted at once, ceil(M s - M u), and a particle has as many copies as
// thresholds lie in its part. One threshold lies at uniform · one(), rounded to half-odd units, so
// that it is inside the open interval and never falls together with a running sum; `shift` turns
// ceil into floor.
PF_RESAMPLING_VECTOR_CLONES
void systematic(const ScaledWeights& weights, double uniform, int* counts) {
  const int bits = weights.fraction_bits;
  const std::int64_t one = weights.one();
  const std::int64_t shift =
      one - 1 - static_cast<std::int64_t>(uniform * static_cast<double>(one));
  std::int64_t running[kBlock + 1];
  running[0] = shift;
  for (std::int64_t begin = 0; begin < weights.size; begin += kBlock) {
    const std::int64_t size = std::min(kBlock, weights.size - begin);
    weights.block(begin, size, running + 1);
    for (std::int64_t i = 0; i < size; ++i) running[i + 1] += running[i];
    for (std::int64_t i = 0; i < size; ++i) {
      const std::uint64_t before = static_cast<std::uint64_t>(running[i]) >> bits;
      const std::uint64_t after = static_cast<std::uint64_t>(running[i + 1]) >> bits;
      counts[begin + i] = static_cast<int>(after - before);
    }
    running[0] = running[size];
  }
}

}  // namespace pf_resampling
