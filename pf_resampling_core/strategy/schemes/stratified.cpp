#include <algorithm>

#include "pf_resampling_core/strategy/schemes/schemes.hpp"

namespace pf_resampling {
namespace {

// Thresholds below the running sum: all of the whole strata, and that of the last one if the sum
// has passed it.
PF_RESAMPLING_VECTOR_CLONES
void count_strata(const ScaledWeights& weights, const double* uniforms, int* counts) {
  const int bits = weights.fraction_bits;
  const std::uint64_t below_one = static_cast<std::uint64_t>(weights.one()) - 1;
  const double unit = 1.0 / static_cast<double>(weights.one());
  std::int64_t running[kBlock];
  int stratum[kBlock];
  double inside[kBlock];
  std::int64_t sum = 0;
  int before = 0;
  for (std::int64_t begin = 0; begin < weights.size; begin += kBlock) {
    const std::int64_t size = std::min(kBlock, weights.size - begin);
    weights.block(begin, size, running);
    for (std::int64_t i = 0; i < size; ++i) running[i] = sum += running[i];
    for (std::int64_t i = 0; i < size; ++i) {
      const std::uint64_t units = static_cast<std::uint64_t>(running[i]);
      stratum[i] = static_cast<int>(units >> bits);
      inside[i] = (from_bits((units & below_one) | 0x4330000000000000u) - 0x1p52) * unit;
    }
    for (std::int64_t i = 0; i < size; ++i) {
      const int below = stratum[i] + (uniforms[stratum[i]] < inside[i] ? 1 : 0);
      counts[begin + i] = below - before;
      before = below;
    }
  }
}

}  // namespace

// Mahmoud section II.E: one threshold in each of the M strata, u_j + j/M.
//
// Mahmoud's listing stores the particle's number where the count belongs (`R(m) = K` for `R(j) +=
// 1`, with K reset in every pass) and lets j run past N when rounding keeps the sum below 1. A peer
// that offsets the strata in integers leaves one survivor of 100 equal weights; another that takes
// an absolute 1e-6 off their width is biased from 1e5 particles on.
void stratified(const ScaledWeights& weights, const ResamplingOptions&, const RandomStream& stream,
                ResamplingWorkspace* work, int* counts) {
  double* uniforms = grow(&work->uniforms, std::int64_t{weights.copies} + 1);
  stream.fill_uniform(0, weights.copies, uniforms);
  uniforms[weights.copies] = 1.0;  // behind the last stratum
  count_strata(weights, uniforms, counts);
}

}  // namespace pf_resampling
