#include "pf_resampling_core/strategy/schemes/sorted_draws.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace pf_resampling {
namespace {

constexpr int kProbes = 4;
using Pair = double __attribute__((vector_size(16)));

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

// To thresholds in [0, largest], and the copy into which each falls.
PF_RESAMPLING_VECTOR_CLONES
void place(const std::int64_t* sums, std::int64_t draws, double scale, double largest,
           double copies_per_unit, double* thresholds, int* cells) {
  for (std::int64_t i = 0; i < draws; ++i) {
    const double value = to_double(sums[i]) * scale;
    const double threshold = value < largest ? value : largest;
    thresholds[i] = threshold;
    cells[i] = static_cast<int>(threshold * copies_per_unit);
  }
}

// draws_below[c]: how many draws fall before copy c.
void index_cells(const int* cells, int draws, int copies, int* draws_below) {
  std::fill(draws_below, draws_below + copies + 1, 0);
  for (int i = 0; i < draws; ++i) draws_below[cells[i] + 1] = i + 1;
  int below = 0;
  for (int copy = 0; copy <= copies; ++copy) {
    below = std::max(below, draws_below[copy]);
    draws_below[copy] = below;
  }
}

}  // namespace

void reserve_sorted_draws(std::int64_t draws, int copies, ResamplingWorkspace* work) {
  grow(&work->uniforms, draws + 1);
  grow(&work->sums, draws);
  grow(&work->cells, draws);
  grow(&work->thresholds, draws + kProbes);
  grow(&work->draws_below, std::int64_t{copies} + 1);
}

// Devroye, "Non-uniform random variate generation", 1986, section V.3.1: partial sums of n + 1
// exponential variables over the whole sum are n sorted uniforms.
void sorted_draws(const RandomStream& stream, std::uint64_t first, int draws, int copies,
                  int fraction_bits, ResamplingWorkspace* work) {
  reserve_sorted_draws(draws, copies, work);
  stream.fill_uniform(first, std::int64_t{draws} + 1, work->uniforms.data());
  // No spacing exceeds -log(2^-53) < 2^6, so that draws + 1 < 2^bits of them stay below 2^62.
  int bits = 1;
  while (((std::int64_t{draws} + 1) >> bits) > 0) ++bits;
  const double units = static_cast<double>(std::int64_t{1} << (56 - bits));
  const std::int64_t sum = sum_spacings(work->uniforms.data(), draws, units, work->sums.data());

  const double total = std::ldexp(static_cast<double>(copies), fraction_bits);
  double* thresholds = work->thresholds.data();
  place(work->sums.data(), draws, total / static_cast<double>(std::max<std::int64_t>(sum, 1)),
        std::nextafter(total, 0.0), std::ldexp(1.0, -fraction_bits), thresholds,
        work->cells.data());
  std::fill(thresholds + draws, thresholds + draws + kProbes,
            std::numeric_limits<double>::infinity());
  index_cells(work->cells.data(), draws, copies, work->draws_below.data());
}

// The draws below the running sum are those before its copy, and the few within the copy. No draw
// depends on the one before, and no branch on how a comparison went.
PF_RESAMPLING_VECTOR_CLONES
void add_draws(const ScaledWeights& weights, std::int64_t mask, const ResamplingWorkspace& work,
               int* counts) {
  const double* thresholds = work.thresholds.data();
  const int* draws_below = work.draws_below.data();
  std::int64_t running[kBlock];
  double positions[kBlock];
  int copies[kBlock];
  int passed[kBlock + 1];
  std::int64_t sum = 0;
  passed[0] = 0;
  for (std::int64_t begin = 0; begin < weights.size; begin += kBlock) {
    const std::int64_t size = std::min(kBlock, weights.size - begin);
    weights.block(begin, size, running);
    for (std::int64_t i = 0; i < size; ++i) running[i] = sum += running[i] & mask;
    for (std::int64_t i = 0; i < size; ++i) {
      positions[i] = to_double(running[i]);
      copies[i] = static_cast<int>(static_cast<std::uint64_t>(running[i]) >> weights.fraction_bits);
    }
    for (std::int64_t i = 0; i < size; ++i) {
      int below = draws_below[copies[i]];
      int inside;
      do {
        Pair first;
        Pair second;
        std::memcpy(&first, thresholds + below, sizeof first);
        std::memcpy(&second, thresholds + below + 2, sizeof second);
        const auto below_position =
            (first < positions[i]) + (second < positions[i]);  // -1 for true
        inside = static_cast<int>(-(below_position[0] + below_position[1]));
        below += inside;
      } while (__builtin_expect(inside == kProbes, 0));
      passed[i + 1] = below;
    }
    for (std::int64_t i = 0; i < size; ++i) counts[begin + i] += passed[i + 1] - passed[i];
    passed[0] = passed[size];
  }
}

}  // namespace pf_resampling
