#include "pf_resampling_core/strategy/schemes/scaled_weights.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/population/lanes.hpp"

namespace pf_resampling {
namespace {

struct Totals {
  double sum = 0.0;
  double maximum = 0.0;
  std::int64_t block_of_maximum = 0;
  std::int64_t units = 0;
  bool suspicious = false;  // something negative (or -0.0), infinite or NaN
};

// What add_up() gathers, in eight lanes.
template <typename R>
struct Gathered {
  typename R::Doubles block_sum[R::kParts] = {};
  typename R::Doubles maximum[R::kParts] = {};
  typename R::Unsigneds units[R::kParts] = {};
  typename R::Unsigneds signs[R::kParts] = {};
};

template <typename R>
PF_RESAMPLING_INLINE void gather(const double* weights, double scale, Gathered<R>* all) {
#pragma GCC unroll 4
  for (int part = 0; part < R::kParts; ++part) {
    typename R::Doubles lanes;
    std::memcpy(&lanes, weights + part * R::kWidth, sizeof lanes);
    typename R::Unsigneds bits;
    std::memcpy(&bits, &lanes, sizeof bits);
    // The sign is set in the one or the other by everything that is negative, infinite or NaN.
    all->signs[part] |= bits | (bits + 0x0010000000000000u);
    all->block_sum[part] += lanes;
    all->maximum[part] = lanes > all->maximum[part] ? lanes : all->maximum[part];
    typename R::Unsigneds fixed;
    to_fixed(lanes * scale, &fixed);
    all->units[part] += fixed;
  }
}

template <int kBytes>
PF_RESAMPLING_INLINE void add_up_in(const double* weights, std::int64_t size, double scale,
                                    Totals* totals) {
  using R = Registers<kBytes>;
  Gathered<R> all;
  double sum[kLanes] = {};
  double lanes[kLanes];
  double so_far = -1.0;
  for (std::int64_t begin = 0; begin < size; begin += kBlock) {
    const std::int64_t end = std::min(begin + kBlock, size);
    std::int64_t i = begin;
    for (; i + kLanes <= end; i += kLanes) gather<R>(weights + i, scale, &all);
    if (i < end) {
      for (int lane = 0; lane < kLanes; ++lane)
        lanes[lane] = i + lane < end ? weights[i + lane] : 0.0;
      gather<R>(lanes, scale, &all);
    }
    // A sum of sums: its rounding errors stay far below the 1e-13 that scale_weights() overlooks.
    std::memcpy(lanes, all.block_sum, sizeof lanes);
    for (int lane = 0; lane < kLanes; ++lane) sum[lane] += lanes[lane];
    for (typename R::Doubles& part : all.block_sum) part = typename R::Doubles{};
    std::memcpy(lanes, all.maximum, sizeof lanes);
    const double maximum = *std::max_element(lanes, lanes + kLanes);
    if (maximum > so_far) {
      so_far = maximum;
      totals->block_of_maximum = begin;
    }
  }
  totals->sum = sum_of_lanes(sum);
  totals->maximum = so_far;
  std::uint64_t units[kLanes];
  std::uint64_t signs[kLanes];
  std::memcpy(units, all.units, sizeof units);
  std::memcpy(signs, all.signs, sizeof signs);
  std::uint64_t all_units = 0;
  std::uint64_t all_signs = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    all_units += units[lane];
    all_signs |= signs[lane];
  }
  totals->units = static_cast<std::int64_t>(all_units);
  totals->suspicious = (all_signs >> 63) != 0;
}

PF_RESAMPLING_BY_WIDTH(add_up, add_up_in,
                       (const double* weights, std::int64_t size, double scale, Totals* totals),
                       (weights, size, scale, totals))

void check_each(const double* weights, std::int64_t size) {
  for (std::int64_t i = 0; i < size; ++i) {
    if (!(weights[i] >= 0.0) || std::isinf(weights[i])) {
      throw Error("resampling: weight " + std::to_string(i) + " of " + std::to_string(size) +
                  " is " + std::to_string(weights[i]) + "; weights must be finite and >= 0");
    }
  }
}

}  // namespace

ScaledWeights scale_weights(const double* weights, std::int64_t size, int copies,
                            std::vector<double>* rescaled) {
  if (size < 1) throw Error("resampling: there are no weights; give at least one");
  if (copies < 1) {
    throw Error("resampling: " + std::to_string(copies) +
                " particles were asked for; ask for at least 1");
  }
  ScaledWeights scaled;
  scaled.weights = weights;
  scaled.size = size;
  scaled.copies = copies;
  int bits_of_copies = 1;
  while ((std::int64_t{copies} >> bits_of_copies) > 0) ++bits_of_copies;
  scaled.fraction_bits = std::min(52, 62 - bits_of_copies);
  scaled.scale = static_cast<double>(scaled.total());

  // As if the weights were normalised, which they mostly are.
  Totals totals;
  add_up(weights, size, scaled.scale, &totals);
  if (totals.suspicious) check_each(weights, size);
  if (!(totals.maximum > 0.0)) {
    throw Error("resampling: all " + std::to_string(size) +
                " weights are zero; reset them to uniform");
  }
  if (totals.maximum < 0x1p-900 || totals.sum > 0x1p900) {
    // Too near to the ends of the double's range for the scale to be a double.
    scaled.exponent = -std::ilogb(totals.maximum);
    double* copy = grow(rescaled, size);
    for (std::int64_t i = 0; i < size; ++i) copy[i] = std::ldexp(weights[i], scaled.exponent);
    weights = copy;
    scaled.weights = copy;
    add_up(weights, size, scaled.scale, &totals);
  }
  if (std::abs(totals.sum - 1.0) > 1e-13) {
    scaled.scale = static_cast<double>(scaled.total()) / totals.sum;
    add_up(weights, size, scaled.scale, &totals);
  }
  scaled.sum = totals.sum;
  const double* block = weights + totals.block_of_maximum;
  scaled.largest =
      totals.block_of_maximum + (std::find(block, weights + size, totals.maximum) - block);
  scaled.correction = scaled.total() - totals.units;
  return scaled;
}

}  // namespace pf_resampling
