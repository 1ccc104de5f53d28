#include <algorithm>
#include <limits>

#include "pf_resampling_core/strategy/schemes/schemes.hpp"

namespace pf_resampling {
namespace {

PF_RESAMPLING_VECTOR_CLONES
void log_ratios(const double* weights, const double* probabilities, std::int64_t size,
                double* out) {
  for (std::int64_t i = 0; i < size; ++i) {
    const bool ranked = weights[i] > 0.0;
    const double log_probability = log_any_vector(ranked ? probabilities[i] : 1.0);
    out[i] = log_any_vector(weights[i]) - log_probability;
  }
}

}  // namespace

// Kwak eq. 3, linear ranking: p_k = (eta_max - (eta_max - eta_min) (rank_k - 1) / (n - 1)) / n with
// eta_min = 2 - eta_max, rank 1 for the largest weight. Kwak leaves ties and n = 1 open: particles
// of equal weight share the mean of their ranks, and one alone has p = 1. Particles of weight zero
// are not ranked: they are impossible, and eq. 3 would bring them back to life.
void rank_based(const ScaledWeights& weights, const ResamplingOptions& options,
                const RandomStream& stream, ResamplingWorkspace* work, int* counts) {
  std::pair<double, int>* order = grow(&work->order, weights.size);
  std::int64_t ranked = 0;
  for (std::int64_t i = 0; i < weights.size; ++i) {
    order[ranked] = {weights.weights[i], static_cast<int>(i)};
    ranked += weights.weights[i] > 0.0 ? 1 : 0;
  }
  std::sort(order, order + ranked);
  double* probabilities = grow(&work->inner_weights, weights.size);
  std::fill(probabilities, probabilities + weights.size, 0.0);
  const double n = static_cast<double>(ranked);
  const double slope = ranked > 1 ? (2.0 * options.rank_max - 2.0) / (n - 1.0) : 0.0;
  const double top = ranked > 1 ? options.rank_max : 1.0;
  for (std::int64_t first = 0; first < ranked;) {
    std::int64_t end = first + 1;
    while (end < ranked && order[end].first == order[first].first) ++end;
    const double mean_rank = n - 0.5 * static_cast<double>(first + end - 1);
    const double probability = (top - slope * (mean_rank - 1.0)) / n;
    for (std::int64_t i = first; i < end; ++i) probabilities[order[i].second] = probability;
    first = end;
  }
  const ScaledWeights scaled =
      scale_weights(probabilities, weights.size, weights.copies, &work->rescaled_inner);
  draw_inner_counts(scaled, options, stream, work, counts);
}

// A copy of particle k carries w_k / p_k, renormalised.
void log_weights_after_rank_based(const ScaledWeights& weights, ResamplingWorkspace* work,
                                  const int* ancestors, int size, double* log_weights) {
  const double* probabilities = work->inner_weights.data();
  double* log_after = grow(&work->log_after, weights.size);
  log_ratios(weights.weights, probabilities, weights.size, log_after);
  // Sum over the copies, shifted by the largest against underflow.
  double largest = -std::numeric_limits<double>::infinity();
  for (int slot = 0; slot < size; ++slot) largest = std::max(largest, log_after[ancestors[slot]]);
  double sum = 0.0;
  for (int slot = 0; slot < size; ++slot) {
    log_weights[slot] = log_after[ancestors[slot]] - largest;
    sum += exp_vector(log_weights[slot]);
  }
  const double log_sum = log_vector(sum);
  for (int slot = 0; slot < size; ++slot) log_weights[slot] -= log_sum;
}

}  // namespace pf_resampling
