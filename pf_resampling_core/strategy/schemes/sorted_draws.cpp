#include "pf_resampling_core/strategy/schemes/sorted_draws.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pf_resampling {
namespace {

// Exponential spacings in fixed point, and their running sum, of which the last is left out of
// `sums` and returned.
PF_RESAMPLING_VECTOR_CLONES
std::int64_t sum_spacings(const double* uniforms, std::int64_t draws, double units,
                          std::int64_t* sums) {
  std::int64_t sum = 0;
  for (std::int64_t begin = 0; begin < draws; begin += kBlock) {
    const std::int64_t end = std::min(begin + kBlock, draws);
    for (std::int64_t i = begin; i < end; ++i) {
      sums[i] = to_fixed(-log_vector(uniforms[i]) * units);
    }
    for (std::int64_t i = begin; i < end; ++i) sums[i] = sum += sums[i];
  }
  return sum + to_fixed(-log_vector(uniforms[draws]) * units);
}

// To thresholds in [0, largest].
PF_RESAMPLING_VECTOR_CLONES
void place(const std::int64_t* sums, std::int64_t draws, double scale, double largest,
           double* thresholds) {
  for (std::int64_t i = 0; i < draws; ++i) {
    const double value = to_double(sums[i]) * scale;
    thresholds[i] = value < largest ? value : largest;
  }
}

}  // namespace

void reserve_sorted_draws(std::int64_t draws, ResamplingWorkspace* work) {
  grow(&work->uniforms, draws + 1);
  grow(&work->sums, draws);
  grow(&work->thresholds, draws + 1);
}

// Devroye, "Non-uniform random variate generation", 1986, section V.3.1: partial sums of n + 1
// exponential variables over the whole sum are n sorted uniforms.
void sorted_draws(const RandomStream& stream, std::uint64_t first, int draws, int copies,
                  int fraction_bits, ResamplingWorkspace* work) {
  reserve_sorted_draws(draws, work);
  stream.fill_uniform(first, std::int64_t{draws} + 1, work->uniforms.data());
  // No spacing exceeds -log(2^-53) < 2^6, so that draws + 1 < 2^bits of them stay below 2^62.
  int bits = 1;
  while (((std::int64_t{draws} + 1) >> bits) > 0) ++bits;
  const double units = static_cast<double>(std::int64_t{1} << (56 - bits));
  const std::int64_t sum = sum_spacings(work->uniforms.data(), draws, units, work->sums.data());

  const double total = std::ldexp(static_cast<double>(copies), fraction_bits);
  double* thresholds = work->thresholds.data();
  place(work->sums.data(), draws, total / static_cast<double>(std::max<std::int64_t>(sum, 1)),
        std::nextafter(total, 0.0), thresholds);
  thresholds[draws] = std::numeric_limits<double>::infinity();
}

void add_draws(const ScaledWeights& weights, std::int64_t mask, const ResamplingWorkspace& work,
               int* counts) {
  const double* next = work.thresholds.data();
  std::int64_t scaled[kBlock];
  std::int64_t sum = 0;
  for (std::int64_t begin = 0; begin < weights.size; begin += kBlock) {
    const std::int64_t size = std::min(kBlock, weights.size - begin);
    weights.block(begin, size, scaled);
    for (std::int64_t i = 0; i < size; ++i) {
      sum += scaled[i] & mask;
      const double position = to_double(sum);
      for (; *next < position; ++next) ++counts[begin + i];
    }
  }
}

}  // namespace pf_resampling
