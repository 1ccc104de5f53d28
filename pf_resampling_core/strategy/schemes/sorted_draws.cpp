#include "pf_resampling_core/strategy/schemes/sorted_draws.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace pf_resampling {
namespace {

constexpr int kProbes = 4;
using Pair = double __attribute__((vector_size(16)));
using Quad = int __attribute__((vector_size(16)));

// Exponential spacings in fixed point, summed up from `sum` on; as bits, where the thresholds will
// be.
PF_RESAMPLING_VECTOR_CLONES
std::uint64_t sum_spacings(const double* uniforms, std::int64_t size, double units,
                           std::uint64_t sum, double* sums) {
  std::uint64_t spacings[kBlock];
  for (std::int64_t i = 0; i < size; ++i) {
    spacings[i] = static_cast<std::uint64_t>(to_fixed(-log_vector(uniforms[i]) * units));
  }
  for (std::int64_t i = 0; i < size; ++i) sums[i] = from_bits(sum += spacings[i]);
  return sum;
}

// To thresholds in [0, largest], and the copy into which each falls.
PF_RESAMPLING_VECTOR_CLONES
void place(std::int64_t size, double scale, double largest, double copies_per_unit,
           double* thresholds, int* cells) {
  for (std::int64_t i = 0; i < size; ++i) {
    const double value = to_double(static_cast<std::int64_t>(to_bits(thresholds[i]))) * scale;
    const double threshold = value < largest ? value : largest;
    thresholds[i] = threshold;
    cells[i] = static_cast<int>(threshold * copies_per_unit);
  }
}

// draws_below[c]: how many draws fall before copy c, where the one before draw number `first` falls
// before copy `next`. Four are written at a time, later ones over earlier: mostly no more copies
// lie between two draws, and nothing is to be guessed. Returns the next `next`.
int index_cells(const int* cells, int first, int size, int next, int* draws_below) {
  for (int i = 0; i < size; ++i) {
    const int draw = first + i;
    const Quad four = {draw, draw, draw, draw};
    std::memcpy(draws_below + next, &four, sizeof four);
    const int end = cells[i] + 1;
    if (__builtin_expect(end - next > 4, 0)) {
      std::fill(draws_below + next + 4, draws_below + end, draw);
    }
    next = end;
  }
  return next;
}

// How many of the thresholds are below each position: those before its copy, and the few within
// the copy. No draw depends on the one before, and no branch on how a comparison went.
void count_below_by_two(const double* thresholds, const int* draws_below, const double* positions,
                        const int* copies, std::int64_t size, int* passed) {
  for (std::int64_t i = 0; i < size; ++i) {
    int below = draws_below[copies[i]];
    int inside;
    do {
      Pair first;
      Pair second;
      std::memcpy(&first, thresholds + below, sizeof first);
      std::memcpy(&second, thresholds + below + 2, sizeof second);
      const auto below_position = (first < positions[i]) + (second < positions[i]);  // -1 for true
      inside = static_cast<int>(-(below_position[0] + below_position[1]));
      below += inside;
    } while (__builtin_expect(inside == kProbes, 0));
    passed[i] = below;
  }
}

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(PF_RESAMPLING_NO_CLONES)
__attribute__((target("avx2,popcnt"))) void count_below_by_four(const double* thresholds,
                                                                const int* draws_below,
                                                                const double* positions,
                                                                const int* copies,
                                                                std::int64_t size, int* passed) {
  for (std::int64_t i = 0; i < size; ++i) {
    const __m256d position = _mm256_broadcast_sd(positions + i);
    int below = draws_below[copies[i]];
    int inside;
    do {
      const __m256d four = _mm256_loadu_pd(thresholds + below);
      const int mask = _mm256_movemask_pd(_mm256_cmp_pd(four, position, _CMP_LT_OQ));
      inside = __builtin_popcount(static_cast<unsigned int>(mask));
      below += inside;
    } while (__builtin_expect(inside == kProbes, 0));
    passed[i] = below;
  }
}

const auto count_below =
    __builtin_cpu_supports("avx2") != 0 ? count_below_by_four : count_below_by_two;
#else
const auto count_below = count_below_by_two;
#endif

}  // namespace

void reserve_sorted_draws(std::int64_t draws, int copies, ResamplingWorkspace* work) {
  grow(&work->thresholds, draws + kProbes);
  grow(&work->draws_below, std::int64_t{copies} + 1 + kProbes);
}

// Devroye, "Non-uniform random variate generation", 1986, section V.3.1: partial sums of n + 1
// exponential variables over the whole sum are n sorted uniforms.
void sorted_draws(const RandomStream& stream, std::uint64_t first, int draws, int copies,
                  int fraction_bits, ResamplingWorkspace* work) {
  reserve_sorted_draws(draws, copies, work);
  double* thresholds = work->thresholds.data();
  // No spacing exceeds -log(2^-53) < 2^6, so that draws + 1 < 2^bits of them stay below 2^62.
  int bits = 1;
  while (((std::int64_t{draws} + 1) >> bits) > 0) ++bits;
  const double units = static_cast<double>(std::int64_t{1} << (56 - bits));
  double uniforms[kBlock];
  std::uint64_t sum = 0;
  for (std::int64_t begin = 0; begin <= draws; begin += kBlock) {
    const std::int64_t size = std::min(kBlock, draws + 1 - begin);
    stream.fill_uniform(first + static_cast<std::uint64_t>(begin), size, uniforms);
    sum = sum_spacings(uniforms, size, units, sum, thresholds + begin);
  }

  const double total = std::ldexp(static_cast<double>(copies), fraction_bits);
  const double scale = total / static_cast<double>(std::max<std::uint64_t>(sum, 1));
  const double largest = std::nextafter(total, 0.0);
  const double copies_per_unit = std::ldexp(1.0, -fraction_bits);
  int cells[kBlock];
  int next = 0;
  for (int begin = 0; begin < draws; begin += static_cast<int>(kBlock)) {
    const int size = std::min(static_cast<int>(kBlock), draws - begin);
    place(size, scale, largest, copies_per_unit, thresholds + begin, cells);
    next = index_cells(cells, begin, size, next, work->draws_below.data());
  }
  std::fill(work->draws_below.begin() + next, work->draws_below.begin() + copies + 1, draws);
  std::fill(thresholds + draws, thresholds + draws + kProbes,
            std::numeric_limits<double>::infinity());
}

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
    count_below(thresholds, draws_below, positions, copies, size, passed + 1);
    for (std::int64_t i = 0; i < size; ++i) counts[begin + i] += passed[i + 1] - passed[i];
    passed[0] = passed[size];
  }
}

}  // namespace pf_resampling
