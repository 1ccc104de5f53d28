#pragma once

#include <cstdint>

/// Sums in eight lanes side by side, whatever the machine's registers hold, have one order, and one
/// result, everywhere.
namespace pf_resampling {

constexpr int kLanes = 8;

/// Sum of eight lanes, in an order of its own.
inline __attribute__((always_inline)) double sum_of_lanes(const double* v) {
  return ((v[0] + v[4]) + (v[1] + v[5])) + ((v[2] + v[6]) + (v[3] + v[7]));
}

/// The eight lanes in registers of one width. A sum kept in registers wider than the machine's goes
/// through memory at every step and takes several times as long; so what sums up is written once as
/// a template over these, and the machine's own is taken when the program runs.
template <int kBytes>
struct Registers {
  // GCC passes over the attribute of a `using` that depends on a parameter.
  typedef double Doubles __attribute__((vector_size(kBytes)));
  typedef std::int64_t Integers __attribute__((vector_size(kBytes)));
  typedef std::uint64_t Unsigneds __attribute__((vector_size(kBytes)));
  static constexpr int kWidth = kBytes / 8;
  static constexpr int kParts = 64 / kBytes;
};

/// Defines `name PARAMETERS` as kernel<16>, kernel<32> or kernel<64> ARGUMENTS, whichever is as
/// wide as the machine's registers. The kernels are PF_RESAMPLING_INLINE templates that return
/// nothing.
// NOLINTBEGIN(bugprone-macro-parentheses): both lists come with parentheses of their own.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(PF_RESAMPLING_NO_CLONES)
#define PF_RESAMPLING_BY_WIDTH(name, kernel, PARAMETERS, ARGUMENTS)                          \
  __attribute__((target("avx512f"))) void name##_64 PARAMETERS {                             \
    kernel<64> ARGUMENTS;                                                                    \
  }                                                                                          \
  __attribute__((target("avx2"))) void name##_32 PARAMETERS {                                \
    kernel<32> ARGUMENTS;                                                                    \
  }                                                                                          \
  void name##_16 PARAMETERS {                                                                \
    kernel<16> ARGUMENTS;                                                                    \
  }                                                                                          \
  void name PARAMETERS {                                                                     \
    static const int width =                                                                 \
        __builtin_cpu_supports("avx512f") ? 64 : (__builtin_cpu_supports("avx2") ? 32 : 16); \
    if (width == 64) {                                                                       \
      name##_64 ARGUMENTS;                                                                   \
    } else if (width == 32) {                                                                \
      name##_32 ARGUMENTS;                                                                   \
    } else {                                                                                 \
      name##_16 ARGUMENTS;                                                                   \
    }                                                                                        \
  }
#else
#define PF_RESAMPLING_BY_WIDTH(name, kernel, PARAMETERS, ARGUMENTS) \
  void name PARAMETERS {                                            \
    kernel<16> ARGUMENTS;                                           \
  }
#endif
// NOLINTEND(bugprone-macro-parentheses)

}  // namespace pf_resampling
