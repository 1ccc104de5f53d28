#include "pf_resampling_core/strategy/schemes/scaled_weights.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/population/lanes.hpp"

namespace pf_resampling {
namespace {

struct Totals {
  double sum = 0.0;
  double maximum = -1.0;
  std::int64_t block_of_maximum = 0;
  std::int64_t units = 0;
  bool suspicious = false;  // something negative (or -0.0), infinite or NaN
};

PF_RESAMPLING_VECTOR_CLONES
Totals add_up(const double* weights, std::int64_t size, double scale) {
  Totals totals;
  double sum[kLanes] = {};
  std::uint64_t units = 0;
  std::uint64_t unusable = 0;
  for (std::int64_t begin = 0; begin < size; begin += kBlock) {
    const std::int64_t end = std::min(begin + kBlock, size);
    // A sum of sums: its rounding errors stay far below the 1e-13 that scale_weights() overlooks.
    Doubles block_sum = {};
    Doubles maxima = {};
    Doubles lanes;
    std::int64_t i = begin;
    for (; i + kLanes <= end; i += kLanes) {
      load(weights + i, &lanes);
      block_sum += lanes;
      maxima = lanes > maxima ? lanes : maxima;
    }
    for (; i < end; ++i) {
      block_sum[i % kLanes] += weights[i];
      maxima[0] = std::max(maxima[0], weights[i]);
    }
    for (i = begin; i < end; ++i) {
      units += static_cast<std::uint64_t>(to_fixed(weights[i] * scale));
      // The sign is set in the one or the other by what is negative, infinite or NaN.
      unusable |= to_bits(weights[i]) | (to_bits(weights[i]) + 0x0010000000000000u);
    }
    double of_lanes[kLanes];
    store(block_sum, of_lanes);
    for (int lane = 0; lane < kLanes; ++lane) sum[lane] += of_lanes[lane];
    store(maxima, of_lanes);
    const double maximum = *std::max_element(of_lanes, of_lanes + kLanes);
    if (maximum > totals.maximum) {
      totals.maximum = maximum;
      totals.block_of_maximum = begin;
    }
  }
  totals.sum = sum_of_lanes(sum);
  totals.units = static_cast<std::int64_t>(units);
  totals.suspicious = unusable >> 63 != 0;
  return totals;
}

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
  Totals totals = add_up(weights, size, scaled.scale);
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
    totals = add_up(weights, size, scaled.scale);
  }
  if (std::abs(totals.sum - 1.0) > 1e-13) {
    scaled.scale = static_cast<double>(scaled.total()) / totals.sum;
    totals = add_up(weights, size, scaled.scale);
  }
  scaled.sum = totals.sum;
  const double* block = weights + totals.block_of_maximum;
  scaled.largest =
      totals.block_of_maximum + (std::find(block, weights + size, totals.maximum) - block);
  scaled.correction = scaled.total() - totals.units;
  return scaled;
}

}  // namespace pf_resampling
