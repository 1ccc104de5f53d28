#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace pf_resampling {

using ConstIndices = Eigen::Ref<const Eigen::ArrayXi>;
using MutableIndices = Eigen::Ref<Eigen::ArrayXi>;

/// Ancestor of every slot from replication counts, such that a survivor keeps its own slot where it
/// has one (ancestors[i] == i whenever counts[i] > 0 and i < ancestors.size()); the other copies
/// fill the free slots in ascending order of ancestor. So as few particles as possible are copied.
/// counts.sum() == ancestors.size(); counts.size() may differ from it. O(N + M), allocates nothing.
void counts_to_ancestors(ConstIndices counts, MutableIndices ancestors);

/// Which particles of the past are still alive: follows ancestor indices over many selections (Kwak
/// section 4.1, "number of distinct particles").
class Ancestry {
 public:
  /// Every one of `size` particles becomes its own ancestor.
  void start(int size);

  /// After a selection: slot i now holds a copy of the former slot ancestors[i].
  void select(ConstIndices ancestors);

  /// How many of the particles at the last start() have descendants, in [1, size].
  int distinct() const;

 private:
  Eigen::ArrayXi origins_;  // for each slot, the particle at the last start() it descends from
  Eigen::ArrayXi scratch_;
  int start_size_ = 0;
};

/// Number of different values in `ancestors`, all in [0, population). `seen` is working space.
int count_distinct(ConstIndices ancestors, int population, std::vector<std::uint8_t>* seen);

}  // namespace pf_resampling
