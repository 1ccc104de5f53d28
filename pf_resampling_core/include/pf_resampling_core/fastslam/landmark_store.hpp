#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "pf_resampling_core/compensation/compensation.hpp"
#include "pf_resampling_core/population/ancestry.hpp"

namespace pf_resampling {

/// A landmark in all particles: entry i of every array belongs to particle i.
struct LandmarkRow {
  double* x = nullptr;  ///< m, map frame
  double* y = nullptr;
  double* xx = nullptr;  ///< m^2, covariance
  double* xy = nullptr;
  double* yy = nullptr;
  double* log_odds = nullptr;    ///< of its existence
  std::uint8_t* held = nullptr;  ///< 1 where the particle has this landmark
};

/// The maps of all particles: a row per landmark, a column per particle, each array contiguous over
/// the particles.
///
/// Selections and compensations are linear maps over the particle axis. They are logged, not
/// applied: a row catches up when it is next asked for. So renewing the population costs O(M)
/// whatever the size of the map, where copying maps costs O(M·N). (Montemerlo's trees give O(M log
/// N), with a pointer chase per landmark.)
class LandmarkStore {
 public:
  explicit LandmarkStore(int particles);
  ~LandmarkStore();
  LandmarkStore(LandmarkStore&&) noexcept;
  LandmarkStore& operator=(LandmarkStore&&) noexcept;

  int particles() const;
  /// Rows are numbered from 0; a removed row's number is used again.
  int rows() const;
  bool is_used(int row) const;

  /// A new landmark that no particle holds yet. `birth`: an id that is the same in all particles.
  int add(std::int64_t birth);
  void remove(int row);
  std::int64_t birth(int row) const;

  /// The row as of now, to read or write; the pointers hold until the next add(), select() or
  /// change of particles.
  LandmarkRow row(int row);

  /// Slot i holds a copy of the former slot ancestors[i] from now on; ancestors.size() may differ
  /// from particles().
  void select(ConstIndices ancestors);

  /// Blends the means of pairs that both hold the landmark, and treats their covariances; see
  /// compensate().
  void blend(const std::vector<BlendPair>& pairs, CovarianceTreatment treatment);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace pf_resampling
