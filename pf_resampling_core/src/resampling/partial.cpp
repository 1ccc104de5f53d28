#include <algorithm>
#include <cmath>

#include "schemes.hpp"

namespace pf_resampling {
namespace {

struct Thresholds {
  double high;
  double low;
};

Thresholds thresholds(const ScaledWeights& weights, const ResamplingOptions& options) {
  const double mean = weights.sum / static_cast<double>(weights.size);
  return {options.partial_high * mean, options.partial_low * mean};
}

// Copies the weights that take part, zero for the moderate ones, and marks these with one copy.
PF_RESAMPLING_VECTOR_CLONES
std::int64_t part(const double* weights, std::int64_t size, double high, double low, double* inner,
                  int* counts) {
  std::int64_t taking_part = 0;
  for (std::int64_t i = 0; i < size; ++i) {
    const bool takes_part = (weights[i] > high) | (weights[i] < low);
    inner[i] = takes_part ? weights[i] : 0.0;
    counts[i] = takes_part ? 0 : 1;
    taking_part += takes_part ? 1 : 0;
  }
  return taking_part;
}

}  // namespace

// K section 3.2: only weights above T_h / M or below T_l / M are resampled, among themselves, to as
// many as they were; the moderate ones keep their slots. K gives no values for the thresholds.
//
// Should all that take part have weight zero (nobody is above T_h / M), none of them can be a
// copy of another; then everybody takes part.
void partial(const ScaledWeights& weights, const ResamplingOptions& options,
             const RandomStream& stream, ResamplingWorkspace* work, int* counts) {
  double* inner = grow(&work->inner_weights, weights.size);
  int* moderate = grow(&work->sort_order, weights.size);
  const Thresholds limit = thresholds(weights, options);
  std::int64_t taking_part =
      part(weights.weights, weights.size, limit.high, limit.low, inner, moderate);
  if (taking_part > 0 &&
      std::all_of(inner, inner + weights.size, [](double w) { return w == 0.0; })) {
    std::copy(weights.weights, weights.weights + weights.size, inner);
    std::fill(moderate, moderate + weights.size, 0);
    taking_part = weights.size;
  }
  if (taking_part == 0) {
    std::fill(counts, counts + weights.size, 1);
    return;
  }
  const ScaledWeights scaled =
      scale_weights(inner, weights.size, static_cast<int>(taking_part), &work->rescaled_inner);
  draw_counts(options.inner_scheme, scaled, stream, work, counts);
  for (std::int64_t i = 0; i < weights.size; ++i) counts[i] += moderate[i];
}

// The moderate keep their weights; the others share the mass they had together, S_hl, equally.
void log_weights_after_partial(const ScaledWeights& weights, const ResamplingWorkspace& work,
                               const int* ancestors, int size, double* log_weights) {
  const int* moderate = work.sort_order.data();
  double moderate_mass = 0.0;
  double shared_mass = 0.0;
  std::int64_t sharing = 0;
  for (std::int64_t i = 0; i < weights.size; ++i) {
    (moderate[i] == 1 ? moderate_mass : shared_mass) += weights.weights[i];
    sharing += 1 - moderate[i];
  }
  const double mass = moderate_mass + shared_mass;
  const double share = shared_mass / mass / static_cast<double>(std::max<std::int64_t>(sharing, 1));
  for (int slot = 0; slot < size; ++slot) {
    const int ancestor = ancestors[slot];
    log_weights[slot] =
        std::log(moderate[ancestor] == 1 ? weights.weights[ancestor] / mass : share);
  }
}

}  // namespace pf_resampling
