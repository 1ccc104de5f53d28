#include "pf_resampling_core/population/ancestry.hpp"

#include <algorithm>

namespace pf_resampling {

void counts_to_ancestors(ConstIndices counts, MutableIndices ancestors) {
  const Eigen::Index inputs = counts.size();
  const Eigen::Index slots = ancestors.size();
  Eigen::Index free_slot = 0;
  // The next slot whose own particle did not survive.
  const auto next_free = [&] {
    while (free_slot < std::min(inputs, slots) && counts[free_slot] > 0) ++free_slot;
    return free_slot++;
  };
  for (Eigen::Index i = 0; i < inputs; ++i) {
    int copies = counts[i];
    if (copies > 0 && i < slots) {
      ancestors[i] = static_cast<int>(i);
      --copies;
    }
    for (; copies > 0; --copies) ancestors[next_free()] = static_cast<int>(i);
  }
}

void Ancestry::start(int size) {
  origins_ = Eigen::ArrayXi::LinSpaced(size, 0, size - 1);
  start_size_ = size;
}

void Ancestry::select(ConstIndices ancestors) {
  scratch_.resize(ancestors.size());
  for (Eigen::Index i = 0; i < ancestors.size(); ++i) scratch_[i] = origins_[ancestors[i]];
  origins_.swap(scratch_);
}

int Ancestry::distinct() const {
  std::vector<std::uint8_t> seen;
  return count_distinct(origins_, start_size_, &seen);
}

int count_distinct(ConstIndices ancestors, int population, std::vector<std::uint8_t>* seen) {
  seen->assign(static_cast<std::size_t>(population), 0);
  int distinct = 0;
  for (Eigen::Index i = 0; i < ancestors.size(); ++i) {
    std::uint8_t& mark = (*seen)[static_cast<std::size_t>(ancestors[i])];
    distinct += mark == 0 ? 1 : 0;
    mark = 1;
  }
  return distinct;
}

}  // namespace pf_resampling
