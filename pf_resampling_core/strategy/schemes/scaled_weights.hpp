#pragma once

#include <cstdint>
#include <cstring>

#include "pf_resampling_core/population/vector_math.hpp"
#include "pf_resampling_core/strategy/resampling.hpp"

namespace pf_resampling {

/// Number of particles handled together: small enough for the first-level cache, and a multiple of
/// every vector width.
constexpr std::int64_t kBlock = 256;

/// A finite x in [0, 2^62], or a register full of them, to the nearest integer, in operations that
/// every vector unit has: 2^52 and a half added leaves the integer in the low bits of a double,
/// once for the upper and once for the lower half.
template <typename Double, typename Unsigned>
PF_RESAMPLING_INLINE void to_fixed(const Double& x, Unsigned* fixed) {
  constexpr double kRound = 6755399441055744.0;  // 1.5 * 2^52
  constexpr std::uint64_t kRoundBits = 0x4338000000000000u;
  const Double upper = x * 0x1p-31 + kRound;
  const Double lower = (x - (upper - kRound) * 0x1p31) + kRound;
  Unsigned upper_bits;
  Unsigned lower_bits;
  std::memcpy(&upper_bits, &upper, sizeof upper);
  std::memcpy(&lower_bits, &lower, sizeof lower);
  *fixed = (upper_bits << 31) + lower_bits - ((kRoundBits << 31) + kRoundBits);
}

PF_RESAMPLING_INLINE std::int64_t to_fixed(double x) {
  std::uint64_t fixed;
  to_fixed(x, &fixed);
  return static_cast<std::int64_t>(fixed);
}

/// An integer in [0, 2^63) to the nearest double.
PF_RESAMPLING_INLINE double to_double(std::int64_t x) {
  const std::uint64_t bits = static_cast<std::uint64_t>(x);
  const double upper = from_bits((bits >> 32) | 0x4530000000000000u);          // 2^84 + 2^32 * ...
  const double lower = from_bits((bits & 0xffffffffu) | 0x4330000000000000u);  // 2^52 + ...
  return (upper - (0x1p84 + 0x1p52)) + lower;
}

/// Weights in copies, M w_k, as integers in units of 1 / one() copies whose sum is exactly
/// M one().
///
/// All schemes work on these. Integer sums are exact and do not depend on their order, so no
/// rounding can lose or add a copy, a particle of weight zero has no width, the schemes that are
/// equal on paper are equal to the last draw, and the running sum costs one cycle per particle. A
/// unit is 2^-42 of a copy for a million particles and smaller for fewer; the running sum of
/// doubles would be a thousand times coarser.
struct ScaledWeights {
  const double* weights = nullptr;
  std::int64_t size = 0;        ///< N
  int copies = 0;               ///< M
  int fraction_bits = 0;        ///< at most 52
  double sum = 0.0;             ///< of the weights
  int exponent = 0;             ///< these weights are the caller's times 2^exponent
  double scale = 0.0;           ///< units per weight
  std::int64_t largest = 0;     ///< the particle of largest weight...
  std::int64_t correction = 0;  ///< ...takes the units that rounding left over

  std::int64_t one() const { return std::int64_t{1} << fraction_bits; }
  std::int64_t total() const { return std::int64_t{copies} << fraction_bits; }

  /// out[i] = scaled weight of particle begin + i, i in [0, count), count <= kBlock.
  PF_RESAMPLING_INLINE void block(std::int64_t begin, std::int64_t count, std::int64_t* out) const {
    for (std::int64_t i = 0; i < count; ++i) out[i] = to_fixed(weights[begin + i] * scale);
    if (largest >= begin && largest < begin + count) out[largest - begin] += correction;
  }
};

/// Scales weights to `copies` copies. The weights must outlive the result, as must `rescaled`,
/// which takes a copy of weights that are too small or too large for the arithmetic. Throws Error
/// on weights that are empty, negative, not finite or sum to zero.
ScaledWeights scale_weights(const double* weights, std::int64_t size, int copies,
                            std::vector<double>* rescaled);

/// Makes room for `size` elements, keeping what is there.
template <typename T>
T* grow(std::vector<T>* array, std::int64_t size) {
  if (array->size() < static_cast<std::size_t>(size)) array->resize(static_cast<std::size_t>(size));
  return array->data();
}

}  // namespace pf_resampling
