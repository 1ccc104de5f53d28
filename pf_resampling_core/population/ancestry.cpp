#include "pf_resampling_core/population/ancestry.hpp"

#include <algorithm>

namespace pf_resampling {

// Free slots and surplus copies are two lists that are paired off, first with first. Both are
// listed without a branch that depends on a single count, which would be guessed wrong for every
// second particle: what is listed too much is written over by the next.
void counts_to_ancestors(ConstIndices counts, MutableIndices ancestors) {
  constexpr int kAtOnce = 4;  // copies
  const int particles = static_cast<int>(counts.size());
  const int slots = static_cast<int>(ancestors.size());
  const int own = std::min(particles, slots);
  thread_local std::vector<int> free_slots, surplus;
  free_slots.resize(static_cast<std::size_t>(slots) + 1);
  surplus.resize(static_cast<std::size_t>(slots) + kAtOnce);
  int free = 0;
  for (int slot = 0; slot < slots; ++slot) {
    ancestors[slot] = slot;
    free_slots[static_cast<std::size_t>(free)] = slot;
    free += slot >= own || counts[slot] == 0 ? 1 : 0;
  }
  int* end = surplus.data();
  for (int particle = 0; particle < particles; ++particle) {
    const int copies = std::max(0, counts[particle] - (particle < own ? 1 : 0));
    std::fill(end, end + kAtOnce, particle);
    if (copies > kAtOnce) std::fill(end + kAtOnce, end + copies, particle);
    end += copies;
  }
  for (int i = 0; i < free; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    ancestors[free_slots[k]] = surplus[k];
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
