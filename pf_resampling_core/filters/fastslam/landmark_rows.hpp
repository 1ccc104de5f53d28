#pragma once

#include <cstdint>
#include <memory>
#include <new>
#include <vector>

#include "pf_resampling_core/filters/fastslam/renewal_log.hpp"

/// Where the rows of the landmark store lie in memory, and the loops that bring them up to date.
namespace pf_resampling {

/// out[i] = first[second[i]], for i in [0, size): selection `first`, followed by `second`.
void compose(const int* first, const int* second, int size, int* out);

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
  /// Sets about fetching it into the cache.
  void prefetch() const;
  std::size_t bytes() const { return doubles_ * sizeof(double); }

 private:
  AlignedDoubles memory_;
  std::size_t doubles_ = 0;
  std::size_t stride_ = 0;
  int particles_ = 0;
};

/// Slot i of `out` becomes slot ancestors[i] of `row`.
void gather(const RowMemory& row, const int* ancestors, int particles, RowMemory* out);

/// Blends one row.
void blend(const LoggedBlend& blend, RowMemory* row);

/// Eight rows side by side: particle by particle, the eight values of a field are next to each
/// other. So a blend, which jumps between particles, is nothing but vector operations; several in
/// a row cost an eighth of what they cost row by row.
class BlendTile {
 public:
  static constexpr int kRows = 8;

  /// For so many particles; with covariances or without. No row stands in any place yet.
  void start(int particles, bool with_covariances);
  /// Puts a row in a place, with its values as they are.
  void put(int place, const RowMemory& row);
  void apply(const LoggedBlend& blend);
  /// Writes what has been blended back.
  void take(int place, RowMemory* row) const;

 private:
  double* field(std::size_t field) { return memory_.get() + field * particles_ * kRows; }
  const double* field(std::size_t field) const {
    return memory_.get() + field * particles_ * kRows;
  }

  AlignedDoubles memory_;               // means, covariances: the first five fields of a row
  std::vector<std::uint64_t> holders_;  // all bits set where the particle holds the landmark
  int capacity_ = 0;
  std::size_t particles_ = 0;
  bool with_covariances_ = false;
  bool all_hold_ = true;
};

}  // namespace pf_resampling
