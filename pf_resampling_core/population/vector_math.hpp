#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

/// Elementary functions without branches or tables, so that the compiler turns a plain loop over
/// particles into vector instructions. They round the same on every machine: the library is
/// compiled without contraction to fused operations, so a wider vector unit gives the same bytes,
/// only sooner.
///
/// Errors are stated against the exact value and checked by the tests against <cmath>.

/// Put before a function with a hot loop: the compiler emits it for each of these instruction sets
/// and the machine's own is taken when the program starts.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(PF_RESAMPLING_NO_CLONES)
#define PF_RESAMPLING_VECTOR_CLONES __attribute__((target_clones("default", "avx2", "avx512f")))
#else
#define PF_RESAMPLING_VECTOR_CLONES
#endif

/// Put before a loop over particles, each of which reads and writes its own entries alone.
#if defined(__clang__)
#define PF_RESAMPLING_INDEPENDENT _Pragma("clang loop vectorize(assume_safety)")
#elif defined(__GNUC__)
#define PF_RESAMPLING_INDEPENDENT _Pragma("GCC ivdep")
#else
#define PF_RESAMPLING_INDEPENDENT
#endif

#define PF_RESAMPLING_INLINE inline __attribute__((always_inline))

namespace pf_resampling {

PF_RESAMPLING_INLINE std::uint64_t to_bits(double value) {
  std::uint64_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

PF_RESAMPLING_INLINE double from_bits(std::uint64_t bits) {
  double value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

/// 64 random bits to the open interval (0, 1): 52 of them as the mantissa of a number in [1, 2).
PF_RESAMPLING_INLINE double open_unit_interval(std::uint64_t bits) {
  return from_bits((bits >> 12) | 0x3ff0000000000000u) - 0x1.fffffffffffffp-1;
}

/// e^x, relative error below 5e-16 for x in [-708, 708]; below that 0, above it infinity, NaN for
/// NaN.
PF_RESAMPLING_INLINE double exp_vector(double x) {
  constexpr double kLog2e = 1.4426950408889634;
  constexpr double kLn2High = 6.93147180369123816490e-01;
  constexpr double kLn2Low = 1.90821492927058770002e-10;
  constexpr double kRound =
      6755399441055744.0;  // 1.5 * 2^52: adding it leaves the integer in the low bits
  const double clamped = x < -708.0 ? -708.0 : (x > 709.0 ? 709.0 : x);
  const double shifted = clamped * kLog2e + kRound;
  const double n = shifted - kRound;
  const double r = (clamped - n * kLn2High) - n * kLn2Low;
  // Taylor to r^13: |r| <= ln(2)/2, remainder below 3e-18. Estrin's order keeps the chain short.
  const double r2 = r * r;
  const double r4 = r2 * r2;
  const double r8 = r4 * r4;
  const double p01 = 1.0 + r;
  const double p23 = 1.0 / 2 + r * (1.0 / 6);
  const double p45 = 1.0 / 24 + r * (1.0 / 120);
  const double p67 = 1.0 / 720 + r * (1.0 / 5040);
  const double p89 = 1.0 / 40320 + r * (1.0 / 362880);
  const double pab = 1.0 / 3628800 + r * (1.0 / 39916800);
  const double pcd = 1.0 / 479001600 + r * (1.0 / 6227020800.0);
  const double p = (p01 + r2 * p23) + r4 * (p45 + r2 * p67) + r8 * ((p89 + r2 * pab) + r4 * pcd);
  const double value = p * from_bits((to_bits(shifted) + 1023u) << 52);
  const double not_small = x < -708.0 ? 0.0 : value;
  return x > 709.0 ? __builtin_inf() : not_small;
}

/// The same for likelihoods: relative error below 2e-10 for x in [-700, 0], half of the work; 0
/// below that.
PF_RESAMPLING_INLINE double exp_likelihood_vector(double x) {
  constexpr double kLog2e = 1.4426950408889634;
  constexpr double kLn2 = 6.93147180559945309417e-01;
  constexpr double kRound = 6755399441055744.0;
  const double shifted = x * kLog2e + kRound;
  const double r = x - (shifted - kRound) * kLn2;
  // Minimax of the relative error on |r| <= ln(2)/2, which is 4e-11.
  const double r2 = r * r;
  const double p01 = 0.9999999999616517 + r * 1.0000000002432905;
  const double p23 = 0.5000000104598398 + r * 0.16666665125215235;
  const double p45 = 0.04166622525012948 + r * 0.008333561181140021;
  const double p67 = 0.0013948195132473717 + r * 0.0001977515840528614;
  const double p = (p01 + r2 * p23) + (r2 * r2) * (p45 + r2 * p67);
  const double value = p * from_bits((to_bits(shifted) + 1023u) << 52);
  return x > -700.0 ? value : 0.0;
}

/// 1 / sqrt(x), relative error below 3e-12 for every positive normal x; finite for 0. Much sooner
/// than by root and division.
PF_RESAMPLING_INLINE double inverse_sqrt_vector(double x) {
  // Halving the exponent is right to 3.4 %; each step of third order (Householder) cubes that.
  double y = from_bits(0x5fe6eb50c7b537a9u - (to_bits(x) >> 1));
#pragma GCC unroll 2
  for (int step = 0; step < 2; ++step) {
    const double a = x * y * y;
    y *= 1.875 + a * (0.375 * a - 1.25);
  }
  return y;
}

/// Natural logarithm, relative error below 1e-15 for every positive normal x; x must be positive
/// and normal.
PF_RESAMPLING_INLINE double log_vector(double x) {
  constexpr double kLn2High = 6.93147180369123816490e-01;
  constexpr double kLn2Low = 1.90821492927058770002e-10;
  // x = m · 2^e with m in [sqrt(1/2), sqrt(2)).
  const std::uint64_t bits = to_bits(x) - 0x3fe6a09e00000000u;
  const std::uint64_t exponent_bits = (bits & 0xfff0000000000000u);
  const double m = from_bits(to_bits(x) - exponent_bits);
  // The exponent as a double without an integer conversion (which AVX2 lacks for 64 bits).
  const double e =
      from_bits(((bits >> 52) ^ 0x800u) | 0x4330000000000000u) - (4503599627370496.0 + 2048.0);
  const double f = m - 1.0;
  const double s = f / (2.0 + f);
  const double z = s * s;
  const double w = z * z;
  // log((1 + s) / (1 - s)) = 2s + s·R(z); coefficients of FreeBSD's e_log.c (minimax on the same
  // interval).
  const double t1 = w * (3.999999999940941908e-01 +
                         w * (2.222219843214978396e-01 + w * 1.531383769920937332e-01));
  const double t2 = z * (6.666666666666735130e-01 +
                         w * (2.857142874366239149e-01 +
                              w * (1.818357216161805012e-01 + w * 1.479819860511658591e-01)));
  const double half_square = 0.5 * f * f;
  return e * kLn2High - ((half_square - (s * (half_square + t1 + t2) + e * kLn2Low)) - f);
}

/// Natural logarithm for every positive x, also below the normal range; -infinity for zero.
PF_RESAMPLING_INLINE double log_any_vector(double x) {
  const bool tiny = x < 0x1p-1022;
  const double logarithm =
      log_vector(tiny ? x * 0x1p54 : x) - (tiny ? 54 * 6.93147180559945309417e-01 : 0.0);
  return x > 0.0 ? logarithm : -__builtin_inf();
}

/// Sine and cosine of x radians, absolute error below 3e-16, for |x| <= 1e5.
PF_RESAMPLING_INLINE void sincos_vector(double x, double* sine, double* cosine) {
  constexpr double kTwoOverPi = 6.36619772367581382433e-01;
  constexpr double kHalfPi1 = 1.57079632673412561417e+00;  // 33 bits
  constexpr double kHalfPi2 = 6.07710050630396597660e-11;  // the next 33 bits
  constexpr double kHalfPi3 = 2.02226624879595063154e-21;
  constexpr double kRound = 6755399441055744.0;
  const double shifted = x * kTwoOverPi + kRound;
  const double n = shifted - kRound;
  const std::uint64_t quadrant = to_bits(shifted);
  const double r = ((x - n * kHalfPi1) - n * kHalfPi2) - n * kHalfPi3;
  const double z = r * r;
  // Taylor to r^17 and r^16 on |r| <= pi/4: remainders below 1e-17.
  const double sine_r =
      r +
      r * z *
          (-1.0 / 6 +
           z * (1.0 / 120 +
                z * (-1.0 / 5040 + z * (1.0 / 362880 + z * (-1.0 / 39916800 +
                                                            z * (1.0 / 6227020800.0 +
                                                                 z * (-1.0 / 1307674368000.0)))))));
  const double cosine_r =
      1.0 -
      z * (0.5 - z * (1.0 / 24 -
                      z * (1.0 / 720 -
                           z * (1.0 / 40320 -
                                z * (1.0 / 3628800 - z * (1.0 / 479001600 -
                                                          z * (1.0 / 87178291200.0 -
                                                               z * (1.0 / 20922789888000.0))))))));
  // Quadrant 1 and 3 swap the two; quadrant 2 and 3 negate the sine, 1 and 2 the cosine.
  const std::uint64_t swap = 0u - (quadrant & 1u);
  const std::uint64_t sine_bits = to_bits(sine_r);
  const std::uint64_t cosine_bits = to_bits(cosine_r);
  const std::uint64_t sine_sign = (quadrant & 2u) << 62;
  const std::uint64_t cosine_sign = ((quadrant + 1u) & 2u) << 62;
  *sine = from_bits(((cosine_bits & swap) | (sine_bits & ~swap)) ^ sine_sign);
  *cosine = from_bits(((sine_bits & swap) | (cosine_bits & ~swap)) ^ cosine_sign);
}

/// Two standard normals in single precision from 64 random bits: Box and Muller's transform, with
/// absolute error below 2e-6. None is beyond 6.7.
PF_RESAMPLING_INLINE void single_normal_pair_vector(std::uint64_t bits, float* first,
                                                    float* second) {
  // Logarithm of a uniform in (0, 1], polynomials of Moshier's Cephes (logf, sinf, cosf).
  const float uniform =
      (static_cast<float>(static_cast<std::int32_t>(bits >> 33)) + 0.5f) * 0x1p-31f;
  std::uint32_t uniform_bits;
  std::memcpy(&uniform_bits, &uniform, sizeof uniform);
  const std::uint32_t exponent_bits = (uniform_bits - 0x3f3504f3u) & 0xff800000u;
  const std::uint32_t mantissa_bits = uniform_bits - exponent_bits;
  float mantissa;
  std::memcpy(&mantissa, &mantissa_bits, sizeof mantissa);
  const float e = static_cast<float>(static_cast<std::int32_t>(exponent_bits) >> 23);
  const float f = mantissa - 1.0f;
  const float square = f * f;
  const float f4 = square * square;
  const float high = (-1.2420140846e-1f + f * 1.1676998740e-1f) +
                     square * (-1.1514610310e-1f + f * 7.0376836292e-2f);
  const float low = (3.3333331174e-1f - f * 2.4999993993e-1f) +
                    square * (2.0000714765e-1f - f * 1.6668057665e-1f);
  const float middle = f4 * (1.4249322787e-1f + f * high);
  const float log = (f - 0.5f * square + f * square * (low + middle)) + e * 0.693147180559945f;
  const float radius = std::sqrt(-2.0f * (log < 0.0f ? log : 0.0f));

  // An angle of a whole turn times 2^-32, as a quadrant and what is over, in [-1/8, 1/8] turn.
  const std::uint32_t turn = static_cast<std::uint32_t>(bits);
  const std::uint32_t quadrant = (turn + 0x20000000u) >> 30;
  const float angle = static_cast<float>(static_cast<std::int32_t>(turn - (quadrant << 30))) *
                      1.4629180792671596e-9f;
  const float z = angle * angle;
  const float sine =
      angle + angle * z * (-1.6666654611e-1f + z * (8.3321608736e-3f - z * 1.9515295891e-4f));
  const float cosine =
      1.0f - 0.5f * z +
      z * z * (4.166664568298827e-2f + z * (-1.388731625493765e-3f + z * 2.443315711809948e-5f));
  const bool swap = (quadrant & 1u) != 0;
  const float x = swap ? sine : cosine;
  const float y = swap ? cosine : sine;
  *first = ((quadrant + 1u) & 2u) != 0 ? -radius * x : radius * x;
  *second = (quadrant & 2u) != 0 ? -radius * y : radius * y;
}

/// Angle in radians brought to [-pi, pi] (to within one rounding at the ends), for |x| <= 1e9.
PF_RESAMPLING_INLINE double wrap_angle_vector(double x) {
  constexpr double kInverseTwoPi = 1.59154943091895345609e-01;
  constexpr double kTwoPiHigh = 6.28318530693650245667e+00;
  constexpr double kTwoPiLow = 2.43084020252158639064e-10;
  constexpr double kRound = 6755399441055744.0;
  const double n = (x * kInverseTwoPi + kRound) - kRound;
  return (x - n * kTwoPiHigh) - n * kTwoPiLow;
}

/// Angle of the vector (x, y) in [-pi, pi], absolute error below 5e-16; 0 for the zero vector.
PF_RESAMPLING_INLINE double atan2_vector(double y, double x) {
  constexpr double kHalfPi = 1.57079632679489661923;
  constexpr double kWholePi = 3.14159265358979323846;
  const double absolute_x = from_bits(to_bits(x) & 0x7fffffffffffffffu);
  const double absolute_y = from_bits(to_bits(y) & 0x7fffffffffffffffu);
  const bool steep = absolute_y > absolute_x;
  const double larger = steep ? absolute_y : absolute_x;
  const double smaller = steep ? absolute_x : absolute_y;
  const double t = larger > 0.0 ? smaller / larger : 0.0;
  // atan(t) = pi/4 + atan((t - 1) / (t + 1)) brings t below 0.66, where the rational approximation
  // of Moshier's Cephes holds.
  const bool reduced = t > 0.66;
  const double u = reduced ? (t - 1.0) / (t + 1.0) : t;
  const double z = u * u;
  const double numerator = (((-8.750608600031904122785e-1 * z - 1.615753718733365076637e1) * z -
                             7.500855792314704667340e1) *
                                z -
                            1.228866684490136173410e2) *
                               z -
                           6.485021904942025371773e1;
  const double denominator =
      ((((z + 2.485846490142306297962e1) * z + 1.650270098316988542046e2) * z +
        4.328810604912902668951e2) *
           z +
       4.853903996359136964868e2) *
          z +
      1.945506571482613964425e2;
  const double small = u + u * z * (numerator / denominator);
  const double octant = reduced ? 0.5 * kHalfPi + small : small;
  const double quadrant = steep ? kHalfPi - octant : octant;
  const double half = x < 0.0 ? kWholePi - quadrant : quadrant;
  return from_bits(to_bits(half) | (to_bits(y) & 0x8000000000000000u));
}

}  // namespace pf_resampling
