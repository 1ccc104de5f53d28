#pragma once

#include <cstdint>
#include <memory>
#include <new>
#include <vector>

#include "pf_resampling_core/strategy/compensation.hpp"

/// Where the rows of the landmark store lie in memory, and the loops that bring them up to date.
namespace pf_resampling {

/// (*out)[i] = first[second[i]]: selection `first`, followed by `second`.
void compose(const std::vector<int>& first, const std::vector<int>& second, std::vector<int>* out);

struct AlignedDelete {
  void operator()(double* memory) const { ::operator delete[](memory, std::align_val_t{64}); }
};
using AlignedDoubles = std::unique_ptr<double[], AlignedDelete>;
/// Zeros, on a boundary of 64 bytes.
AlignedDoubles aligned_doubles(std::size_t size);

/// Memory of one row: six arrays of doubles and one of bytes, each on a boundary of 64 bytes and
/// padded to a multiple of eight particles.
class RowMemory {
 public:
  enum Field : std::size_t { x, y, xx, xy, yy, log_odds };
  static constexpr std::size_t kFields = 6;

  RowMemory() = default;
  RowMemory(const RowMemory& other) { *this = other; }
  RowMemory& operator=(const RowMemory& other);
  RowMemory(RowMemory&&) noexcept = default;
  RowMemory& operator=(RowMemory&&) noexcept = default;

  /// Room for so many particles; what is in there is zero, or left from before.
  void fit(int particles);

  int particles() const { return particles_; }
  double* field(std::size_t field) { return memory_.get() + field * stride_; }
  const double* field(std::size_t field) const { return memory_.get() + field * stride_; }
  std::uint8_t* held() { return reinterpret_cast<std::uint8_t*>(field(kFields)); }
  const std::uint8_t* held() const { return reinterpret_cast<const std::uint8_t*>(field(kFields)); }
  bool all_hold() const;
  std::size_t bytes() const { return doubles_ * sizeof(double); }

 private:
  AlignedDoubles memory_;
  std::size_t doubles_ = 0;
  std::size_t stride_ = 0;
  int particles_ = 0;
};

/// Slot i of `out` becomes slot ancestors[i] of `row`.
void gather(const RowMemory& row, const std::vector<int>& ancestors, RowMemory* out);

/// Blends the pairs in a row, one after the other.
void blend(const std::vector<BlendPair>& pairs, CovarianceTreatment treatment, RowMemory* row);

}  // namespace pf_resampling
