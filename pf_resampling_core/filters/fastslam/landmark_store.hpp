#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "pf_resampling_core/population/ancestry.hpp"
#include "pf_resampling_core/strategy/compensation.hpp"

namespace pf_resampling {

/// A landmark in all particles: entry i of every array belongs to particle i.
struct LandmarkRow {
  double* x = nullptr;  ///< m, map frame
  double* y = nullptr;
  double* xx = nullptr;  ///< m^2, covariance
  double* xy = nullptr;
  double* yy = nullptr;
  double* log_odds = nullptr;    ///< of its existence
  std::uint8_t* held = nullptr;  ///< 1 where the particle has this landmark, 0 elsewhere

  Eigen::Vector2d mean(Eigen::Index i) const { return {x[i], y[i]}; }
  Eigen::Matrix2d covariance(Eigen::Index i) const {
    return (Eigen::Matrix2d() << xx[i], xy[i], xy[i], yy[i]).finished();
  }
  /// Gives particle i this landmark.
  void put(Eigen::Index i, const Eigen::Vector2d& mean, const Eigen::Matrix2d& covariance,
           double existence) const {
    x[i] = mean.x();
    y[i] = mean.y();
    xx[i] = covariance(0, 0);
    xy[i] = covariance(0, 1);
    yy[i] = covariance(1, 1);
    log_odds[i] = existence;
    held[i] = 1;
  }
};

/// The maps of all particles: a row per landmark, a column per particle, each array contiguous over
/// the particles. Functions that take a row take one that add() gave and remove() did not take
/// back.
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
  explicit LandmarkStore(int particles) : particles_(particles) { forget_composed(); }

  int particles() const { return particles_; }
  /// One more than the largest number of a row so far. Rows are numbered from 0; a removed row's
  /// number is used again, the latest first.
  int rows() const { return static_cast<int>(rows_.size()); }
  bool is_used(int row) const { return at(row).is_used; }

  /// A new landmark that no particle holds yet, all zero. `birth`: an id that is the same in all
  /// particles.
  int add(std::int64_t birth);
  void remove(int row);
  std::int64_t birth(int row) const { return at(row).birth; }

  /// The row as of now, to read or write; the pointers hold until the row's removal or the next
  /// select() or blend().
  LandmarkRow row(int row);

  /// Slot i holds a copy of the former slot ancestors[i] from now on; ancestors.size() may differ
  /// from particles(). O(M), see above.
  void select(ConstIndices ancestors);

  /// Blends the means of pairs that both hold the landmark, and treats their covariances; what only
  /// one of the two holds, and log_odds, is left. See compensate(). O(M·N). The pairs have been
  /// checked.
  void blend(const std::vector<BlendPair>& pairs, CovarianceTreatment treatment);

 private:
  static constexpr Eigen::Index kX = 0, kY = 1, kXx = 2, kXy = 3, kYy = 4, kLogOdds = 5,
                                kFields = 6;
  struct Row {
    Eigen::ArrayXXd fields;  // a column each, padded
    std::vector<std::uint8_t> held;
    std::int64_t birth = 0;
    std::size_t version = 0;  // it has gone through so many of the logged selections
    bool is_used = false;
  };

  Row& at(int row) { return rows_[static_cast<std::size_t>(row)]; }
  const Row& at(int row) const { return rows_[static_cast<std::size_t>(row)]; }
  void forget_composed();
  void catch_up(Row* row);
  void catch_up_all();

  int particles_;
  std::vector<Row> rows_;
  std::vector<int> free_rows_;
  std::vector<std::vector<int>> log_;  // selections since all rows were up to date
  // The selections from number `from_` on as one, up to now: rows that were seen together lag
  // together.
  std::vector<int> composed_;
  std::size_t from_ = 0;
};

}  // namespace pf_resampling
