#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "pf_resampling_core/population/ancestry.hpp"

namespace pf_resampling {

/// The selections that the population has gone through, for rows that are still to go through them.
/// Step t leads from version t to version t + 1.
///
/// Selections compose, so those from any version on become one map, in O(log(length)) compositions:
/// of every stretch [j·2^k, (j + 1)·2^k) the composition is kept, which is one composition more per
/// step on average, and as much memory as the selections themselves.
class SelectionLog {
 public:
  std::int64_t oldest() const { return levels_.front().first; }
  std::int64_t now() const { return now_; }

  void append(ConstIndices ancestors);

  /// Forgets the steps before `version`.
  void drop_before(std::int64_t version);

  /// All from `version`, in [oldest(), now()), as one: slot i holds what was in slot [i] before the
  /// first of them. Holds until the next call of anything.
  const std::vector<int>& from(std::int64_t version);

  /// Bytes that the steps take.
  std::size_t memory() const;

 private:
  // Compositions of 2^k steps each, empty where the first half was forgotten; the first is number
  // `first`.
  struct Level {
    std::deque<std::vector<int>> maps;
    std::int64_t first = 0;
  };

  const std::vector<int>* map_at(std::size_t level, std::int64_t number) const;
  // The map of the longest stretch kept that begins at `version` and is over by now.
  const std::vector<int>& longest_map_from(std::int64_t version, std::int64_t* end) const;

  std::int64_t now_ = 0;
  std::vector<Level> levels_ = std::vector<Level>(1);

  // The last answer of from(), since rows that were seen together lag together.
  std::vector<int> answer_, composed_;
  std::int64_t answer_from_ = -1;
  std::int64_t answer_now_ = -1;
};

}  // namespace pf_resampling
