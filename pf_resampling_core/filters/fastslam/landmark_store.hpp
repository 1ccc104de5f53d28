#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "pf_resampling_core/population/ancestry.hpp"
#include "pf_resampling_core/strategy/compensation.hpp"

namespace pf_resampling {

/// A landmark in all particles: entry i of every array belongs to particle i. Each array begins on
/// a boundary of 64 bytes and may be read and written up to the next multiple of eight particles.
struct LandmarkRow {
  double* x = nullptr;  ///< m, map frame
  double* y = nullptr;
  double* xx = nullptr;  ///< m^2, covariance
  double* xy = nullptr;
  double* yy = nullptr;
  double* log_odds = nullptr;    ///< of its existence
  std::uint8_t* held = nullptr;  ///< 1 where the particle has this landmark, 0 elsewhere
};

/// The maps of all particles: a row per landmark, a column per particle, each array contiguous over
/// the particles.
///
/// Selections are logged, not applied: a row catches up when it is next asked for, with one gather
/// per array, since selections compose. So resampling costs O(M) where copying maps costs O(M·N):
/// all N rows are brought up to date once in 4·N selections, and in a thousand. (Montemerlo's trees
/// give O(M log N), with a pointer chase per landmark.) Compensations do not compose; they are
/// applied to all rows at once.
///
/// The numbers are the same, to the bit, as if every selection were applied at once.
class LandmarkStore {
 public:
  /// Throws Error for less than one particle.
  explicit LandmarkStore(int particles);
  ~LandmarkStore();
  /// A copy has all rows up to date, and those of the other are brought up to date: O(M·N).
  LandmarkStore(const LandmarkStore& other);
  LandmarkStore& operator=(const LandmarkStore& other);
  LandmarkStore(LandmarkStore&&) noexcept;
  LandmarkStore& operator=(LandmarkStore&&) noexcept;

  int particles() const;
  /// One more than the largest number of a row so far. Rows are numbered from 0; a removed row's
  /// number is used again, the latest first.
  int rows() const;
  bool is_used(int row) const;

  /// A new landmark that no particle holds yet, all zero. `birth`: an id that is the same in all
  /// particles.
  int add(std::int64_t birth);
  /// The functions with a row throw Error when it is not in use.
  void remove(int row);
  std::int64_t birth(int row) const;

  /// The row as of now, to read or write; the pointers hold until the row's removal or the next
  /// select() or blend().
  LandmarkRow row(int row);

  /// Slot i holds a copy of the former slot ancestors[i] from now on; ancestors.size() may differ
  /// from particles(). O(M), see above. Throws Error, changing nothing, on no ancestors or one out
  /// of range.
  void select(ConstIndices ancestors);

  /// Blends the means of pairs that both hold the landmark, and treats their covariances; what only
  /// one of the two holds, and log_odds, is left. See compensate(). O(M·N). Throws Error, changing
  /// nothing, as check_pairs() does.
  void blend(const std::vector<BlendPair>& pairs, CovarianceTreatment treatment);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace pf_resampling
