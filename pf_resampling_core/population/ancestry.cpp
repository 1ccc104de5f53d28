#include "pf_resampling_core/population/ancestry.hpp"

#include <algorithm>
#include <numeric>

namespace pf_resampling {
namespace {

// Slots that are free and particles with copies to spare are listed a chunk at a time, without a
// branch that depends on a single count: it would be guessed wrong for every second particle.
constexpr int kChunk = 256;

/// Numbers below `size` for which `is_in` holds, ascending, one after the other.
template <typename IsIn>
class Listed {
 public:
  Listed(int size, const IsIn& is_in) : size_(size), is_in_(is_in) {}

  /// Goes on to the next; false at the end.
  bool next() {
    ++at_;
    while (at_ >= count_ && seen_ < size_) {
      at_ = count_ = 0;
      for (const int end = std::min(seen_ + kChunk, size_); seen_ < end; ++seen_) {
        items_[count_] = seen_;
        count_ += is_in_(seen_) ? 1 : 0;
      }
    }
    return at_ < count_;
  }
  int item() const { return items_[at_]; }

 private:
  int size_;
  IsIn is_in_;
  int seen_ = 0, count_ = 0, at_ = -1;
  int items_[kChunk];
};

}  // namespace

void counts_to_ancestors(ConstIndices counts, MutableIndices ancestors) {
  const int particles = static_cast<int>(counts.size());
  const int slots = static_cast<int>(ancestors.size());
  const int own = std::min(particles, slots);
  std::iota(ancestors.data(), ancestors.data() + slots, 0);
  Listed free(slots, [&](int slot) { return slot >= own || counts[slot] == 0; });
  Listed spare(particles,
               [&](int particle) { return counts[particle] > (particle < own ? 1 : 0); });
  int copies = 0;
  while (free.next()) {
    if (copies == 0) {
      if (!spare.next()) return;  // the counts are too few
      copies = counts[spare.item()] - (spare.item() < own ? 1 : 0);
    }
    ancestors[free.item()] = spare.item();
    --copies;
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
