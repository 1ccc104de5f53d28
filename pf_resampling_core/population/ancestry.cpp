#include "pf_resampling_core/population/ancestry.hpp"

#include <algorithm>

namespace pf_resampling {

void counts_to_ancestors(ConstIndices counts, MutableIndices ancestors) {
  const int particles = static_cast<int>(counts.size());
  const int slots = static_cast<int>(ancestors.size());
  const int own = std::min(particles, slots);  // that have a slot of their own
  // Listed without a branch on a count, which would be guessed wrong for every second particle.
  thread_local std::vector<int> free, plural;
  free.resize(static_cast<std::size_t>(slots) + 1);
  plural.resize(static_cast<std::size_t>(particles) + 1);
  int* end_of_free = free.data();
  int* end_of_plural = plural.data();
  for (int i = 0; i < own; ++i) {
    ancestors[i] = *end_of_free = *end_of_plural = i;
    end_of_free += counts[i] == 0 ? 1 : 0;
    end_of_plural += counts[i] > 1 ? 1 : 0;
  }
  for (int i = own; i < slots; ++i) *end_of_free++ = i;
  for (int i = own; i < particles; ++i) *end_of_plural++ = i;

  const int* slot = free.data();
  for (const int* ancestor = plural.data(); ancestor != end_of_plural; ++ancestor) {
    const int copies = counts[*ancestor] - (*ancestor < own ? 1 : 0);
    for (int copy = 0; copy < copies; ++copy) ancestors[*slot++] = *ancestor;
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
