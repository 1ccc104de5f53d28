#pragma once

#include <cstdint>

namespace pf_resampling {

/// What a draw is for. Streams of different purposes never share a number, so adding a draw
/// somewhere leaves all others as they were. Values are part of the recorded behaviour: append,
/// never renumber.
enum class RandomPurpose : std::uint32_t {
  initialization = 1,
  motion = 2,
  resampling = 3,
  excitation = 4,
  injection = 5,
  simulation_motion = 6,
  simulation_observation = 7,
  compensation = 8,
  association = 9,
  selection = 10,
  noise_factors = 11,
  saving = 12,
  redraw = 13,
  test = 100,
};

/// A stream of random numbers with random access: number `index` of the stream (seed, purpose,
/// step) is the same whenever, in whatever order and by whichever thread it is drawn.
///
/// Generator: Threefry 2x64-20 (Salmon, Moraes, Dror, Shaw: "Parallel random numbers: as easy as 1,
/// 2, 3", SC 2011). A value type, 16 bytes.
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, RandomPurpose purpose, std::uint32_t step)
      : seed_(seed),
        purpose_and_step_((std::uint64_t{static_cast<std::uint32_t>(purpose)} << 32) | step) {}

  /// Uniform in the open interval (0, 1), an odd multiple of 2^-53.
  double uniform(std::uint64_t index) const;

  /// out[i] = uniform(first + i), for i in [0, count).
  void fill_uniform(std::uint64_t first, std::int64_t count, double* out) const;

  /// Standard normal number `index`: Box-Muller on uniforms 2·⌊index/2⌋ and 2·⌊index/2⌋ + 1.
  double normal(std::uint64_t index) const;

  /// out[i] = normal(first + i), for i in [0, count).
  void fill_normal(std::uint64_t first, std::int64_t count, double* out) const;

  /// Four standard normals per particle, each in an array of its own: a[i] … d[i] are the normals
  /// 4·(first + i) … 4·(first + i) + 3. The form that particle loops want.
  void fill_normal4(std::uint64_t first, std::int64_t count, double* a, double* b, double* c,
                    double* d) const;

  /// The same in single precision and from half as many blocks of the generator, for noise that is
  /// drawn for every particle at every step.
  void fill_single_normal4(std::uint64_t first, std::int64_t count, float* a, float* b, float* c,
                           float* d) const;

 private:
  std::uint64_t seed_;
  std::uint64_t purpose_and_step_;
};

/// One block of the generator, exposed for its published test vectors: counter and key as in the
/// paper.
void threefry2x64_20(const std::uint64_t counter[2], const std::uint64_t key[2],
                     std::uint64_t out[2]);

}  // namespace pf_resampling
