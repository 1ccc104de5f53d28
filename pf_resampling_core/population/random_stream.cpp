#include "pf_resampling_core/population/random_stream.hpp"

#include <cmath>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/population/vector_math.hpp"

namespace pf_resampling {
namespace {

struct Block {
  std::uint64_t first;
  std::uint64_t second;
};

PF_RESAMPLING_INLINE std::uint64_t rotate_left(std::uint64_t value, int bits) {
  return (value << bits) | (value >> (64 - bits));
}

// Threefry 2x64 with 20 rounds (Salmon et al. 2011, section 4.2). Only additions, rotations and
// exclusive ors of 64-bit lanes, which every vector unit has; Philox's wide products are emulated
// on most.
PF_RESAMPLING_INLINE Block threefry(std::uint64_t counter0, std::uint64_t counter1,
                                    std::uint64_t key0, std::uint64_t key1) {
  const std::uint64_t keys[3] = {key0, key1, 0x1BD11BDAA9FC1A22u ^ key0 ^ key1};
  constexpr int kRotations[8] = {16, 42, 12, 31, 16, 32, 24, 21};
  std::uint64_t x0 = counter0 + keys[0];
  std::uint64_t x1 = counter1 + keys[1];
#pragma GCC unroll 20
  for (int round = 0; round < 20; ++round) {
    x0 += x1;
    x1 = rotate_left(x1, kRotations[round % 8]) ^ x0;
    if (round % 4 == 3) {
      const int injection = round / 4 + 1;
      x0 += keys[injection % 3];
      x1 += keys[(injection + 1) % 3] + static_cast<std::uint64_t>(injection);
    }
  }
  return {x0, x1};
}

// Box and Muller's transform of one block.
PF_RESAMPLING_INLINE void normal_pair(const Block& block, double* first, double* second) {
  const double radius = std::sqrt(-2.0 * log_vector(open_unit_interval(block.first)));
  double sine;
  double cosine;
  sincos_vector(2.0 * kPi * open_unit_interval(block.second), &sine, &cosine);
  *first = radius * cosine;
  *second = radius * sine;
}

PF_RESAMPLING_VECTOR_CLONES
void uniform_blocks(std::uint64_t key0, std::uint64_t key1, std::uint64_t first_block,
                    std::int64_t blocks, double* out) {
  for (std::int64_t i = 0; i < blocks; ++i) {
    const Block block = threefry(first_block + static_cast<std::uint64_t>(i), 0, key0, key1);
    out[2 * i] = open_unit_interval(block.first);
    out[2 * i + 1] = open_unit_interval(block.second);
  }
}

PF_RESAMPLING_VECTOR_CLONES
void normal_blocks(std::uint64_t key0, std::uint64_t key1, std::uint64_t first_block,
                   std::int64_t blocks, double* out) {
  for (std::int64_t i = 0; i < blocks; ++i) {
    const Block block = threefry(first_block + static_cast<std::uint64_t>(i), 0, key0, key1);
    normal_pair(block, out + 2 * i, out + 2 * i + 1);
  }
}

PF_RESAMPLING_VECTOR_CLONES
void normal_quadruples(std::uint64_t key0, std::uint64_t key1, std::uint64_t first,
                       std::int64_t count, double* a, double* b, double* c, double* d) {
  for (std::int64_t i = 0; i < count; ++i) {
    const std::uint64_t index = 2u * (first + static_cast<std::uint64_t>(i));
    normal_pair(threefry(index, 0, key0, key1), a + i, b + i);
    normal_pair(threefry(index + 1u, 0, key0, key1), c + i, d + i);
  }
}

PF_RESAMPLING_VECTOR_CLONES
void single_normal_quadruples(std::uint64_t key0, std::uint64_t key1, std::uint64_t first,
                              std::int64_t count, float* __restrict a, float* __restrict b,
                              float* __restrict c, float* __restrict d) {
  for (std::int64_t i = 0; i < count; ++i) {
    const Block block = threefry(first + static_cast<std::uint64_t>(i), 0, key0, key1);
    single_normal_pair_vector(block.first, a + i, b + i);
    single_normal_pair_vector(block.second, c + i, d + i);
  }
}

}  // namespace

void threefry2x64_20(const std::uint64_t counter[2], const std::uint64_t key[2],
                     std::uint64_t out[2]) {
  const Block block = threefry(counter[0], counter[1], key[0], key[1]);
  out[0] = block.first;
  out[1] = block.second;
}

double RandomStream::uniform(std::uint64_t index) const {
  const Block block = threefry(index / 2, 0, seed_, purpose_and_step_);
  return open_unit_interval(index % 2 == 0 ? block.first : block.second);
}

void RandomStream::fill_uniform(std::uint64_t first, std::int64_t count, double* out) const {
  if (count > 0 && first % 2 == 1) {
    *out++ = uniform(first++);
    --count;
  }
  uniform_blocks(seed_, purpose_and_step_, first / 2, count / 2, out);
  if (count % 2 == 1) out[count - 1] = uniform(first + static_cast<std::uint64_t>(count) - 1);
}

double RandomStream::normal(std::uint64_t index) const {
  double pair[2];
  normal_blocks(seed_, purpose_and_step_, index / 2, 1, pair);
  return pair[index % 2];
}

void RandomStream::fill_normal(std::uint64_t first, std::int64_t count, double* out) const {
  if (count > 0 && first % 2 == 1) {
    *out++ = normal(first++);
    --count;
  }
  normal_blocks(seed_, purpose_and_step_, first / 2, count / 2, out);
  if (count % 2 == 1) out[count - 1] = normal(first + static_cast<std::uint64_t>(count) - 1);
}

void RandomStream::fill_normal4(std::uint64_t first, std::int64_t count, double* a, double* b,
                                double* c, double* d) const {
  normal_quadruples(seed_, purpose_and_step_, first, count, a, b, c, d);
}

void RandomStream::fill_single_normal4(std::uint64_t first, std::int64_t count, float* a, float* b,
                                       float* c, float* d) const {
  single_normal_quadruples(seed_, purpose_and_step_, first, count, a, b, c, d);
}

}  // namespace pf_resampling
