#include <algorithm>
#include <cmath>

#include "pf_resampling_core/strategy/schemes/schemes.hpp"

namespace pf_resampling {
namespace {

// Copies the weights that take part, with zero for the moderate ones, and marks these. A weight of
// zero always takes part, so that its slot falls free. Returns how many take part.
PF_RESAMPLING_VECTOR_CLONES
int divide(const double* weights, std::int64_t size, double high, double low, double* inner,
           int* moderate) {
  int moderates = 0;
  for (std::int64_t i = 0; i < size; ++i) {
    const double weight = weights[i];
    const double at_least = weight >= low ? weight : 0.0;
    const double kept = at_least <= high ? at_least : 0.0;
    inner[i] = kept > 0.0 ? 0.0 : weight;
    moderate[i] = kept > 0.0 ? 1 : 0;
  }
  for (std::int64_t i = 0; i < size; ++i) moderates += moderate[i];
  return static_cast<int>(size) - moderates;
}

PF_RESAMPLING_VECTOR_CLONES
void add_moderate(const int* moderate, std::int64_t size, int* counts) {
  for (std::int64_t i = 0; i < size; ++i) counts[i] += moderate[i];
}

PF_RESAMPLING_VECTOR_CLONES
void log_weights_of_slots(const double* weights, const int* moderate, std::int64_t size,
                          double inverse_mass, double log_share, double* log_weights) {
  for (std::int64_t i = 0; i < size; ++i) {
    const double own = log_any_vector(weights[i] * inverse_mass);
    log_weights[i] = moderate[i] == 1 ? own : log_share;
  }
}

}  // namespace

// Kwak section 3.2: only weights above T_h / M or below T_l / M are resampled, among themselves, to
// as many as they were; the moderate ones keep their slots. Kwak gives no values for the
// thresholds.
//
// Should nobody be above T_h / M and all below T_l / M have weight zero, there is nothing that
// could fill their slots; then everybody takes part.
void partial(const ScaledWeights& weights, const ResamplingOptions& options,
             const RandomStream& stream, ResamplingWorkspace* work, int* counts) {
  double* inner = grow(&work->inner_weights, weights.size);
  int* moderate = grow(&work->moderate, weights.size);
  const double mean = weights.sum / static_cast<double>(weights.size);
  int taking_part = divide(weights.weights, weights.size, options.partial_high * mean,
                           options.partial_low * mean, inner, moderate);
  if (taking_part == 0) {
    std::fill(counts, counts + weights.size, 1);
    work->sharing = 0;
    return;
  }
  if (std::all_of(inner, inner + weights.size, [](double weight) { return weight == 0.0; })) {
    std::copy(weights.weights, weights.weights + weights.size, inner);
    std::fill(moderate, moderate + weights.size, 0);
    taking_part = static_cast<int>(weights.size);
  }
  const ScaledWeights scaled =
      scale_weights(inner, weights.size, taking_part, &work->rescaled_inner);
  draw_inner_counts(scaled, options, stream, work, counts);
  add_moderate(moderate, weights.size, counts);
  work->shared_mass = std::ldexp(scaled.sum, -scaled.exponent);
  work->sharing = taking_part;
}

// The moderate keep their weights, and their slots; the others share the mass they had together,
// S_hl, equally.
void log_weights_after_partial(const ScaledWeights& weights, ResamplingWorkspace* work, const int*,
                               int size, double* log_weights) {
  const double inverse_sum = 1.0 / weights.sum;
  const double share = work->sharing > 0 ? work->shared_mass * inverse_sum / work->sharing : 1.0;
  log_weights_of_slots(weights.weights, work->moderate.data(), size, inverse_sum,
                       log_any_vector(share), log_weights);
}

}  // namespace pf_resampling
