#pragma once

#include <cstdint>
#include <cstring>

/// Eight numbers side by side, as GCC's and Clang's vector extension. The compiler splits them into
/// what the machine has; sums kept in eight lanes therefore have one order, and one result,
/// everywhere.
namespace pf_resampling {

constexpr int kLanes = 8;

using Doubles = double __attribute__((vector_size(64)));
using Integers = std::int64_t __attribute__((vector_size(64)));
using Unsigneds = std::uint64_t __attribute__((vector_size(64)));

// References, since vectors wider than the machine's cannot be passed by value across instruction
// sets.
#define PF_RESAMPLING_LANES inline __attribute__((always_inline))

PF_RESAMPLING_LANES void load(const double* from, Doubles* to) {
  std::memcpy(to, from, sizeof *to);
}

PF_RESAMPLING_LANES void store(const Doubles& from, double* to) {
  std::memcpy(to, &from, sizeof from);
}

/// Sum of eight lanes, in an order of its own.
PF_RESAMPLING_LANES double sum_of_lanes(const double* v) {
  return ((v[0] + v[4]) + (v[1] + v[5])) + ((v[2] + v[6]) + (v[3] + v[7]));
}

}  // namespace pf_resampling
