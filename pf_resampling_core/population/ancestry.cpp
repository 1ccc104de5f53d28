#include "pf_resampling_core/population/ancestry.hpp"

#include <algorithm>
#include <cstring>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace pf_resampling {
namespace {

// Free slots and surplus copies are two lists that are paired off, first with first. Both are
// gathered a chunk at a time, without a branch that depends on a single count: such a branch would
// be guessed wrong for every second particle, at ten times the price of all the rest.
constexpr int kChunk = 256;
constexpr int kManyCopies = 16;  // beyond that a particle is handled by itself
constexpr int kSlack = 16;       // what is written behind the end of a list before it grows

enum class Is { zero, more_than_one };

// Bit i set: counts[i] is zero, or more than one; i in [0, 64).
template <Is is>
inline std::uint64_t mask_of_64(const int* counts) {
  std::uint64_t mask = 0;
#if defined(__SSE2__)
  for (int part = 0; part < 4; ++part) {
    __m128i hits[4];
    for (int i = 0; i < 4; ++i) {
      __m128i four;
      std::memcpy(&four, counts + 16 * part + 4 * i, sizeof four);
      hits[i] = is == Is::zero ? _mm_cmpeq_epi32(four, _mm_setzero_si128())
                               : _mm_cmpgt_epi32(four, _mm_set1_epi32(1));
    }
    const __m128i bytes =
        _mm_packs_epi16(_mm_packs_epi32(hits[0], hits[1]), _mm_packs_epi32(hits[2], hits[3]));
    const auto bits = static_cast<std::uint32_t>(_mm_movemask_epi8(bytes));
    mask |= std::uint64_t{bits} << (16 * part);
  }
#else
  for (int i = 0; i < 64; ++i) {
    const bool hit = is == Is::zero ? counts[i] == 0 : counts[i] > 1;
    mask |= std::uint64_t{hit} << i;
  }
#endif
  return mask;
}

// Positions of the bits of `mask`, plus `base`. Writes up to 8 more than it returns.
inline int list_bits(std::uint64_t mask, int base, int* out) {
  const int total = __builtin_popcountll(mask);
  for (int listed = 0; listed < total; listed += 8) {
    for (int i = 0; i < 8; ++i) {
      out[listed + i] = base + __builtin_ctzll(mask | (std::uint64_t{1} << 63));
      mask &= mask - 1;
    }
  }
  return total;
}

// Surplus copies of particles base + i for the bits i of `mask`, up to the first with many copies,
// of which `stopped_at` is told.
inline int list_copies(const int* counts, std::uint64_t mask, int base, int* out, int* stopped_at) {
  int total = 0;
  for (; mask != 0; mask &= mask - 1) {
    const int particle = base + __builtin_ctzll(mask);
    const int copies = counts[particle] - 1;
    if (copies > kManyCopies) {
      *stopped_at = particle;
      break;
    }
    for (int i = 0; i < 4; ++i) out[total + i] = particle;
    for (int i = 4; i < copies; ++i) out[total + i] = particle;
    total += copies;
  }
  return total;
}

// Over a multiple of 64: every slot its own ancestor, the free ones listed.
int list_free_slots(const int* counts, int begin, int end, int* ancestors, int* out) {
  int total = 0;
  for (int base = begin; base < end; base += 64) {
    for (int i = 0; i < 64; ++i) ancestors[base + i] = base + i;
    total += list_bits(mask_of_64<Is::zero>(counts + base), base, out + total);
  }
  return total;
}

int list_surplus(const int* counts, int begin, int end, int* out, int* stopped_at) {
  int total = 0;
  for (int base = begin; base < end && *stopped_at < 0; base += 64) {
    total += list_copies(counts, mask_of_64<Is::more_than_one>(counts + base), base, out + total,
                         stopped_at);
  }
  return total;
}

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(PF_RESAMPLING_NO_CLONES)

// The same with the one instruction that is made for it.
__attribute__((target("avx512f"))) int list_free_slots_avx512(const int* counts, int begin, int end,
                                                              int* ancestors, int* out) {
  int total = 0;
  __m512i slots =
      _mm512_add_epi32(_mm512_set1_epi32(begin),
                       _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15));
  for (int base = begin; base < end; base += 16) {
    const __m512i sixteen = _mm512_loadu_si512(counts + base);
    _mm512_storeu_si512(ancestors + base, slots);
    const __mmask16 free = _mm512_cmpeq_epi32_mask(sixteen, _mm512_setzero_si512());
    _mm512_storeu_si512(out + total, _mm512_maskz_compress_epi32(free, slots));
    total += __builtin_popcount(free);
    slots = _mm512_add_epi32(slots, _mm512_set1_epi32(16));
  }
  return total;
}

// Up to three of each particle, which are most, without a branch.
__attribute__((target("avx512f,bmi2,popcnt"))) int list_surplus_avx512(const int* counts, int begin,
                                                                       int end, int* out,
                                                                       int* stopped_at) {
  int total = 0;
  const __m512i pairs = _mm512_setr_epi32(0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7);
  for (int base = begin; base < end && *stopped_at < 0; base += 16) {
    const __m512i sixteen = _mm512_loadu_si512(counts + base);
    const __mmask16 surplus = _mm512_cmpgt_epi32_mask(sixteen, _mm512_set1_epi32(1));
    if (_mm512_cmpgt_epi32_mask(sixteen, _mm512_set1_epi32(3)) == 0) {
      // Two bits for each particle, one for each surplus copy.
      const __mmask16 twice = _mm512_cmpgt_epi32_mask(sixteen, _mm512_set1_epi32(2));
      const unsigned int copies = _pdep_u32(surplus, 0x55555555u) | _pdep_u32(twice, 0xaaaaaaaau);
      const auto first = static_cast<__mmask16>(copies);
      const auto second = static_cast<__mmask16>(copies >> 16);
      const __m512i lower = _mm512_add_epi32(pairs, _mm512_set1_epi32(base));
      const __m512i upper = _mm512_add_epi32(pairs, _mm512_set1_epi32(base + 8));
      _mm512_storeu_si512(out + total, _mm512_maskz_compress_epi32(first, lower));
      total += __builtin_popcount(first);
      _mm512_storeu_si512(out + total, _mm512_maskz_compress_epi32(second, upper));
      total += __builtin_popcount(second);
    } else {
      total += list_copies(counts, surplus, base, out + total, stopped_at);
    }
  }
  return total;
}

const bool kHasCompress =
    __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("bmi2") != 0;
const auto free_slots_of = kHasCompress ? list_free_slots_avx512 : list_free_slots;
const auto surplus_of = kHasCompress ? list_surplus_avx512 : list_surplus;
#else
const auto free_slots_of = list_free_slots;
const auto surplus_of = list_surplus;
#endif

// A list whose front is taken off.
template <int kCapacity>
struct List {
  int items[static_cast<std::size_t>(kCapacity + kSlack)];
  int size = 0;

  void drop(int count) {
    size -= count;
    std::memmove(items, items + count, static_cast<std::size_t>(size) * sizeof(int));
  }
};

// Slots whose own particle did not survive, ascending. Gives all others their own particle.
class FreeSlots {
 public:
  FreeSlots(const int* counts, int particles, int* ancestors, int slots)
      : counts_(counts), ancestors_(ancestors), own_(std::min(particles, slots)), slots_(slots) {}

  void gather() {
    while (list_.size < kChunk && next_ < slots_) {
      const int whole = std::min(kChunk, (own_ - next_) / 64 * 64);
      if (whole > 0) {
        const int end = next_ + whole;
        list_.size += free_slots_of(counts_, next_, end, ancestors_, list_.items + list_.size);
        next_ = end;
      } else {
        const int end = std::min(next_ + kChunk, slots_);
        for (; next_ < end; ++next_) {
          ancestors_[next_] = next_;
          if (next_ >= own_ || counts_[next_] == 0) list_.items[list_.size++] = next_;
        }
      }
    }
  }

  bool all_seen() const { return next_ == slots_; }
  List<2 * kChunk>& list() { return list_; }

 private:
  const int* counts_;
  int* ancestors_;
  int own_;
  int slots_;
  int next_ = 0;
  List<2 * kChunk> list_;
};

// Copies that do not go to their own slot, ascending by particle.
class Surplus {
 public:
  Surplus(const int* counts, int particles, int slots)
      : counts_(counts), own_(std::min(particles, slots)), particles_(particles) {}

  void gather() {
    while (list_.size < kChunk && many_ == 0 && next_ < particles_) {
      const int whole = std::min(kChunk, (own_ - next_) / 64 * 64);
      if (whole > 0) {
        const int end = next_ + whole;
        int stopped_at = -1;
        list_.size += surplus_of(counts_, next_, end, list_.items + list_.size, &stopped_at);
        next_ = end;
        if (stopped_at >= 0) set_aside(stopped_at, counts_[stopped_at] - 1);
      } else {
        const int copies = counts_[next_] - (next_ < own_ && counts_[next_] > 0 ? 1 : 0);
        if (copies > kManyCopies) {
          set_aside(next_, copies);
        } else {
          for (int i = 0; i < copies; ++i) list_.items[list_.size++] = next_;
          ++next_;
        }
      }
    }
  }

  bool done() const { return list_.size == 0 && many_ == 0 && next_ == particles_; }
  List<kChunk*(kManyCopies + 1)>& list() { return list_; }
  /// A particle with many copies, to follow on the list, and how many of them are still to come.
  int particle_with_many() const { return particle_with_many_; }
  int& many() { return many_; }

 private:
  void set_aside(int particle, int copies) {
    particle_with_many_ = particle;
    many_ = copies;
    next_ = particle + 1;
  }

  const int* counts_;
  int own_;
  int particles_;
  int next_ = 0;
  int particle_with_many_ = 0;
  int many_ = 0;
  List<kChunk*(kManyCopies + 1)> list_;
};

}  // namespace

void counts_to_ancestors(ConstIndices counts, MutableIndices ancestors) {
  const int particles = static_cast<int>(counts.size());
  const int slots = static_cast<int>(ancestors.size());
  int* out = ancestors.data();
  FreeSlots free(counts.data(), particles, out, slots);
  Surplus surplus(counts.data(), particles, slots);
  while (true) {
    free.gather();
    surplus.gather();
    auto& free_slots = free.list();
    auto& copies = surplus.list();
    const int pairs = std::min(free_slots.size, copies.size);
    for (int i = 0; i < pairs; ++i) out[free_slots.items[i]] = copies.items[i];
    free_slots.drop(pairs);
    copies.drop(pairs);
    if (copies.size == 0 && surplus.many() > 0) {
      const int many = std::min(free_slots.size, surplus.many());
      for (int i = 0; i < many; ++i) out[free_slots.items[i]] = surplus.particle_with_many();
      free_slots.drop(many);
      surplus.many() -= many;
    }
    if (surplus.done()) free_slots.size = 0;  // none, unless the counts are too few
    if (free.all_seen() && free_slots.size == 0) return;
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
