#include "pf_resampling_core/filters/fastslam/landmark_rows.hpp"

#include <algorithm>
#include <cstring>

#include "pf_resampling_core/population/vector_math.hpp"

namespace pf_resampling {
namespace {

PF_RESAMPLING_VECTOR_CLONES
void gather_doubles(const double* __restrict from, const int* __restrict ancestors, int size,
                    double* __restrict out) {
  for (int i = 0; i < size; ++i) out[i] = from[ancestors[i]];
}

PF_RESAMPLING_VECTOR_CLONES
void compose_arrays(const int* __restrict first, const int* __restrict second, int size,
                    int* __restrict out) {
  for (int i = 0; i < size; ++i) out[i] = first[second[i]];
}

}  // namespace

void compose(const std::vector<int>& first, const std::vector<int>& second, std::vector<int>* out) {
  out->resize(second.size());
  compose_arrays(first.data(), second.data(), static_cast<int>(second.size()), out->data());
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

void gather(const RowMemory& row, const std::vector<int>& ancestors, RowMemory* out) {
  const int particles = static_cast<int>(ancestors.size());
  out->fit(particles);
  for (std::size_t f = 0; f < RowMemory::kFields; ++f) {
    gather_doubles(row.field(f), ancestors.data(), particles, out->field(f));
  }
  const std::uint8_t* held = row.held();
  std::uint8_t* held_out = out->held();
  if (row.all_hold()) {
    std::memset(held_out, 1, ancestors.size());
  } else {
    for (const int ancestor : ancestors) *held_out++ = held[ancestor];
  }
}

// low <- share·low + (1 - share)·high (Kwak eq. 8 with the pair's weights normalised), where both
// hold the landmark; the covariance as that of the mixture of the two, or left.
void blend(const std::vector<BlendPair>& pairs, CovarianceTreatment treatment, RowMemory* row) {
  const bool all_hold = row->all_hold();
  const std::uint8_t* held = row->held();
  double* x = row->field(RowMemory::x);
  double* y = row->field(RowMemory::y);
  double* xx = row->field(RowMemory::xx);
  double* xy = row->field(RowMemory::xy);
  double* yy = row->field(RowMemory::yy);
  for (const BlendPair& pair : pairs) {
    const int low = pair.low;
    const int high = pair.high;
    if (!all_hold && !(held[low] != 0 && held[high] != 0)) continue;
    const double share = pair.share;
    const double rest = pair.share_of_high();
    if (treatment == CovarianceTreatment::moment_matched) {
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

}  // namespace pf_resampling
