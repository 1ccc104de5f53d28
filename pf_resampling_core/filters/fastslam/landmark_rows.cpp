#include "pf_resampling_core/filters/fastslam/landmark_rows.hpp"

#include <algorithm>
#include <cstring>

#include "pf_resampling_core/population/lanes.hpp"
#include "pf_resampling_core/population/vector_math.hpp"

namespace pf_resampling {
namespace {

constexpr std::size_t kMeans = 2;  // x, y
constexpr std::size_t kMeansAndCovariances = 5;

PF_RESAMPLING_VECTOR_CLONES
void gather_doubles(const double* __restrict from, const int* __restrict ancestors, int size,
                    double* __restrict out) {
  for (int i = 0; i < size; ++i) out[i] = from[ancestors[i]];
}

struct TileFields {
  double* field[kMeansAndCovariances];
  const std::uint64_t* holders;
};

// The formulas of blend() below, for eight rows at once.
template <bool with_covariances, bool some_do_not_hold>
PF_RESAMPLING_LANES void blend_lanes(const LoggedBlend& blend, const TileFields& tile) {
  const std::size_t pairs = blend.low.size();
  for (std::size_t p = 0; p < pairs; ++p) {
    const std::ptrdiff_t low = std::ptrdiff_t{blend.low[p]} * kLanes;
    const std::ptrdiff_t high = std::ptrdiff_t{blend.high[p]} * kLanes;
    const double share = blend.share[p];
    const double rest = blend.rest[p];
    constexpr std::size_t kFields = with_covariances ? kMeansAndCovariances : kMeans;
    Doubles lows[kFields];
    Doubles highs[kFields];
    Doubles blended[kFields];
    for (std::size_t f = 0; f < kFields; ++f) {
      load(tile.field[f] + low, &lows[f]);
      load(tile.field[f] + high, &highs[f]);
      blended[f] = share * lows[f] + rest * highs[f];
    }
    if constexpr (with_covariances) {
      const Doubles dx = highs[0] - lows[0];
      const Doubles dy = highs[1] - lows[1];
      const double spread = share * rest;
      blended[2] = blended[2] + spread * (dx * dx);
      blended[3] = blended[3] + spread * (dx * dy);
      blended[4] = blended[4] + spread * (dy * dy);
    }
    if constexpr (some_do_not_hold) {
      Integers both;
      Integers high_holds;
      std::memcpy(&both, tile.holders + low, sizeof both);
      std::memcpy(&high_holds, tile.holders + high, sizeof high_holds);
      both &= high_holds;
      for (std::size_t f = 0; f < kFields; ++f) blended[f] = both != 0 ? blended[f] : lows[f];
    }
    for (std::size_t f = 0; f < kFields; ++f) store(blended[f], tile.field[f] + low);
  }
}

PF_RESAMPLING_VECTOR_CLONES
void blend_tile(const LoggedBlend& blend, const TileFields& tile, bool with_covariances,
                bool some_do_not_hold) {
  if (with_covariances) {
    if (some_do_not_hold) {
      blend_lanes<true, true>(blend, tile);
    } else {
      blend_lanes<true, false>(blend, tile);
    }
  } else if (some_do_not_hold) {
    blend_lanes<false, true>(blend, tile);
  } else {
    blend_lanes<false, false>(blend, tile);
  }
}

}  // namespace

PF_RESAMPLING_VECTOR_CLONES
void compose(const int* __restrict first, const int* __restrict second, int size,
             int* __restrict out) {
  for (int i = 0; i < size; ++i) out[i] = first[second[i]];
}

AlignedDoubles aligned_doubles(std::size_t size) {
  auto* memory =
      static_cast<double*>(::operator new[](size * sizeof(double), std::align_val_t{64}));
  std::fill(memory, memory + size, 0.0);
  return AlignedDoubles(memory);
}

RowMemory& RowMemory::operator=(const RowMemory& other) {
  AlignedDoubles memory;
  if (other.memory_) {
    memory = aligned_doubles(other.doubles_);
    std::copy(other.memory_.get(), other.memory_.get() + other.doubles_, memory.get());
  }
  memory_ = std::move(memory);
  doubles_ = other.doubles_;
  stride_ = other.stride_;
  particles_ = other.particles_;
  return *this;
}

void RowMemory::fit(int particles) {
  constexpr std::size_t kPage = 4096 / sizeof(double);
  std::size_t stride = (static_cast<std::size_t>(particles) + 7) / 8 * 8;
  // Fields a whole number of pages apart would compete for the same places of the cache.
  if (stride % kPage == 0) stride += 8;
  particles_ = particles;
  if (stride == stride_) return;
  stride_ = stride;
  const std::size_t doubles_of_held = (stride + 63) / 64 * 8;
  doubles_ = kFields * stride + doubles_of_held;
  memory_ = aligned_doubles(doubles_);
}

bool RowMemory::all_hold() const {
  return std::memchr(held(), 0, static_cast<std::size_t>(particles_)) == nullptr;
}

void RowMemory::prefetch() const {
  constexpr std::size_t kLine = 64 / sizeof(double);
  for (std::size_t i = 0; i < doubles_; i += kLine) __builtin_prefetch(memory_.get() + i);
}

void gather(const RowMemory& row, const int* ancestors, int particles, RowMemory* out) {
  out->fit(particles);
  for (std::size_t f = 0; f < RowMemory::kFields; ++f) {
    gather_doubles(row.field(f), ancestors, particles, out->field(f));
  }
  const std::uint8_t* held = row.held();
  std::uint8_t* held_out = out->held();
  if (row.all_hold()) {
    std::memset(held_out, 1, static_cast<std::size_t>(particles));
  } else {
    for (int i = 0; i < particles; ++i) held_out[i] = held[ancestors[i]];
  }
}

// low <- share·low + (1 - share)·high (Kwak eq. 8 with the pair's weights normalised), where both
// hold the landmark; the covariance as that of the mixture of the two, or left.
void blend(const LoggedBlend& blend, RowMemory* row) {
  const bool all_hold = row->all_hold();
  const bool moment_matched = blend.treatment == CovarianceTreatment::moment_matched;
  const std::uint8_t* held = row->held();
  double* x = row->field(RowMemory::x);
  double* y = row->field(RowMemory::y);
  double* xx = row->field(RowMemory::xx);
  double* xy = row->field(RowMemory::xy);
  double* yy = row->field(RowMemory::yy);
  for (std::size_t p = 0; p < blend.low.size(); ++p) {
    const int low = blend.low[p];
    const int high = blend.high[p];
    if (!all_hold && !(held[low] != 0 && held[high] != 0)) continue;
    const double share = blend.share[p];
    const double rest = blend.rest[p];
    if (moment_matched) {
      const double dx = x[high] - x[low];
      const double dy = y[high] - y[low];
      const double spread = share * rest;
      xx[low] = share * xx[low] + rest * xx[high] + spread * (dx * dx);
      xy[low] = share * xy[low] + rest * xy[high] + spread * (dx * dy);
      yy[low] = share * yy[low] + rest * yy[high] + spread * (dy * dy);
    }
    x[low] = share * x[low] + rest * x[high];
    y[low] = share * y[low] + rest * y[high];
  }
}

void BlendTile::start(int particles, bool with_covariances) {
  if (particles > capacity_) {
    const auto places = static_cast<std::size_t>(particles) * kRows;
    memory_ = aligned_doubles(kMeansAndCovariances * places);
    holders_.resize(places);
    capacity_ = particles;
  }
  particles_ = static_cast<std::size_t>(particles);
  with_covariances_ = with_covariances;
  all_hold_ = true;
}

void BlendTile::put(int place, const RowMemory& row) {
  const std::size_t fields = with_covariances_ ? kMeansAndCovariances : kMeans;
  for (std::size_t f = 0; f < fields; ++f) {
    const double* from = row.field(f);
    double* to = field(f) + place;
    for (std::size_t i = 0; i < particles_; ++i) to[i * kRows] = from[i];
  }
  // The holders are looked at only if one of the rows is not held by all.
  if (row.all_hold()) return;
  if (all_hold_) std::fill(holders_.begin(), holders_.end(), ~std::uint64_t{0});
  all_hold_ = false;
  const std::uint8_t* held = row.held();
  std::uint64_t* to = holders_.data() + place;
  for (std::size_t i = 0; i < particles_; ++i) {
    to[i * kRows] = held[i] != 0 ? ~std::uint64_t{0} : 0;
  }
}

void BlendTile::apply(const LoggedBlend& blend) {
  TileFields fields{};
  for (std::size_t f = 0; f < kMeansAndCovariances; ++f) fields.field[f] = field(f);
  fields.holders = holders_.data();
  blend_tile(blend, fields, blend.treatment == CovarianceTreatment::moment_matched, !all_hold_);
}

void BlendTile::take(int place, RowMemory* row) const {
  const std::size_t fields = with_covariances_ ? kMeansAndCovariances : kMeans;
  for (std::size_t f = 0; f < fields; ++f) {
    const double* from = field(f) + place;
    double* to = row->field(f);
    for (std::size_t i = 0; i < particles_; ++i) to[i] = from[i * kRows];
  }
}

}  // namespace pf_resampling
