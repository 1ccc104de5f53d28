#pragma once

#include <cstdint>
#include <vector>

#include "pf_resampling_core/filters/fastslam/ring.hpp"
#include "pf_resampling_core/population/ancestry.hpp"
#include "pf_resampling_core/strategy/compensation.hpp"

namespace pf_resampling {

/// A compensation in the log: pairs as arrays.
struct LoggedBlend {
  std::vector<int> low;
  std::vector<int> high;
  std::vector<double> share;
  std::vector<double> rest;  ///< share of the high one
  CovarianceTreatment treatment = CovarianceTreatment::keep;
};

/// Several selections as one: slot i holds what was in slot ancestors[i] before the first of them.
struct ComposedSelection {
  const int* ancestors = nullptr;  ///< one per particle after the last of them
  int particles = 0;
  std::int64_t end = 0;  ///< version to which they lead
};

/// What has happened to the population, for rows that are still to go through it. Step t leads from
/// version t to version t + 1.
///
/// Selections compose, so those from any version on become one map, in O(log(length)) compositions:
/// of every stretch [j·2^k, (j + 1)·2^k) of selections alone the composition is kept, which is one
/// composition more per step on average, and as much memory as the selections themselves. Other
/// kinds of step do not compose and are gone through one by one.
class RenewalLog {
 public:
  std::int64_t oldest() const { return oldest_; }
  std::int64_t now() const { return oldest_ + static_cast<std::int64_t>(steps_.size()); }

  void append_selection(ConstIndices ancestors);
  void append_blend(const std::vector<BlendPair>& pairs, CovarianceTreatment treatment);

  /// Forgets the steps before `version`.
  void drop_before(std::int64_t version);

  /// The blend that leads on from `version`, null if it is none. version in [oldest(), now()).
  const LoggedBlend* blend_at(std::int64_t version) const;

  /// All selections from `version`, which is followed by one, up to the next step of another kind
  /// or to now(). Holds until the next call of anything.
  ComposedSelection selections_from(std::int64_t version);

  /// Blends before `version`, since the beginning. version in [oldest(), now()].
  std::int64_t blends_before(std::int64_t version) const;

  /// Bytes that the steps take.
  std::size_t memory() const;

 private:
  struct Step {
    bool is_blend;
    std::int64_t blends_before;
  };
  // Compositions of 2^k steps each, empty where not all are selections; the first is number
  // `first`.
  struct Level {
    Ring<std::vector<int>> maps;
    std::int64_t first = 0;
  };

  void append(bool is_blend, std::vector<int> map);
  void push(std::size_t level, std::vector<int> map);
  const std::vector<int>* map_at(std::size_t level, std::int64_t number) const;
  // The map of the longest stretch kept that begins at `version` and is over by now; null if none.
  const std::vector<int>* longest_map_from(std::int64_t version, std::int64_t* end) const;
  std::vector<int> spare_map(std::size_t size);

  std::int64_t oldest_ = 0;
  std::int64_t blends_ = 0;
  Ring<Step> steps_;
  Ring<LoggedBlend> kept_blends_;
  std::vector<Level> levels_;
  std::vector<std::vector<int>> spare_maps_;

  // The last answer of selections_from(), since rows that were seen together lag together.
  std::vector<const std::vector<int>*> path_;
  std::vector<int> composed_;
  std::vector<int> composed_swap_;
  ComposedSelection answer_;
  std::int64_t answer_from_ = -1;
  std::int64_t answer_now_ = -1;
};

}  // namespace pf_resampling
