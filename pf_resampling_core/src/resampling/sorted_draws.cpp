#include "sorted_draws.hpp"

#include <algorithm>
#include <limits>

namespace pf_resampling {
namespace {

// Exponential spacings in fixed point, then their running sum, of which the last is left out of
// `thresholds` and returned.
PF_RESAMPLING_VECTOR_CLONES
std::int64_t spacings(const double* uniforms, std::int64_t draws, double units,
                      std::int64_t* thresholds) {
  std::int64_t sum = 0;
  for (std::int64_t begin = 0; begin < draws; begin += kBlock) {
    const std::int64_t end = std::min(begin + kBlock, draws);
    for (std::int64_t i = begin; i < end; ++i) {
      thresholds[i] = to_fixed(-log_vector(uniforms[i]) * units);
    }
    for (std::int64_t i = begin; i < end; ++i) thresholds[i] = sum += thresholds[i];
  }
  return sum + to_fixed(-log_vector(uniforms[draws]) * units);
}

PF_RESAMPLING_VECTOR_CLONES
void rescale(std::int64_t draws, double scale, std::int64_t largest, std::int64_t* thresholds) {
  for (std::int64_t i = 0; i < draws; ++i) {
    const std::int64_t value = to_fixed(to_double(thresholds[i]) * scale);
    thresholds[i] = value < largest ? value : largest;
  }
}

}  // namespace

void reserve_sorted_draws(std::int64_t draws, ResamplingWorkspace* work) {
  grow(&work->uniforms, draws + 1);
  grow(&work->thresholds, draws + 1);
}

void sorted_draws(const RandomStream& stream, std::uint64_t first, std::int64_t draws,
                  std::int64_t total, ResamplingWorkspace* work) {
  reserve_sorted_draws(draws, work);
  double* uniforms = work->uniforms.data();
  std::int64_t* thresholds = work->thresholds.data();
  stream.fill_uniform(first, draws + 1, uniforms);
  // No spacing exceeds -log(2^-53) < 2^6, so that draws + 1 < 2^bits of them stay below 2^62.
  int bits = 1;
  while (((draws + 1) >> bits) > 0) ++bits;
  const double units = static_cast<double>(std::int64_t{1} << (56 - bits));
  const std::int64_t sum = spacings(uniforms, draws, units, thresholds);
  rescale(draws, static_cast<double>(total) / static_cast<double>(std::max<std::int64_t>(sum, 1)),
          total - 1, thresholds);
  thresholds[draws] = std::numeric_limits<std::int64_t>::max();
}

void add_draws(const ScaledWeights& weights, std::int64_t mask, std::int64_t draws,
               const ResamplingWorkspace& work, int* counts) {
  static_cast<void>(draws);
  const std::int64_t* threshold = work.thresholds.data();
  std::int64_t running[kBlock];
  std::int64_t sum = 0;
  int before = 0;
  int drawn = 0;
  for (std::int64_t begin = 0; begin < weights.size; begin += kBlock) {
    const std::int64_t size = std::min(kBlock, weights.size - begin);
    weights.block(begin, size, running);
    for (std::int64_t i = 0; i < size; ++i) running[i] = sum += running[i] & mask;
    // A step either passes a threshold or goes on to the next particle: no branch to guess wrong.
    int passed[kBlock + 1];
    passed[0] = before;
    for (std::int64_t i = 0; i < size;) {
      const int inside = threshold[drawn] < running[i] ? 1 : 0;
      drawn += inside;
      passed[i + 1] = drawn;
      i += 1 - inside;
    }
    for (std::int64_t i = 0; i < size; ++i) counts[begin + i] += passed[i + 1] - passed[i];
    before = drawn;
  }
}

}  // namespace pf_resampling
