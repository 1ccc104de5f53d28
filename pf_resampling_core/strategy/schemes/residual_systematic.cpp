#include <algorithm>

#include "pf_resampling_core/strategy/schemes/schemes.hpp"

namespace pf_resampling {

// Kwak Table II, after Bolić, Djurić and Hong, "New resampling algorithms for particle filters",
// ICASSP 2003: one loop that carries the distance from the running sum to the next threshold.
//
//   n_k  = floor((w_k - dU) M) + 1
//   dU  += n_k / M - w_k
//
// Kwak prints the bracket without saying that it is floor; truncation, which a C++ cast does,
// differs from it whenever w_k < dU and then gives 1 copy for 0. `room` is one() - 1 - dU in units,
// so that both lines become a sum of which the whole copies are split off. Equal to systematic()
// for the same uniform.
PF_RESAMPLING_VECTOR_CLONES
void residual_systematic(const ScaledWeights& weights, double uniform, int* counts) {
  const int bits = weights.fraction_bits;
  const std::uint64_t below_one = static_cast<std::uint64_t>(weights.one()) - 1;
  std::uint64_t room = below_one - static_cast<std::uint64_t>(static_cast<std::int64_t>(
                                       uniform * static_cast<double>(weights.one())));
  std::int64_t scaled[kBlock];
  for (std::int64_t begin = 0; begin < weights.size; begin += kBlock) {
    const std::int64_t size = std::min(kBlock, weights.size - begin);
    weights.block(begin, size, scaled);
    for (std::int64_t i = 0; i < size; ++i) {
      room += static_cast<std::uint64_t>(scaled[i]);
      counts[begin + i] = static_cast<int>(room >> bits);
      room &= below_one;
    }
  }
}

}  // namespace pf_resampling
