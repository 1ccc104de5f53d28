#include <algorithm>

#include "pf_resampling_core/strategy/schemes/schemes.hpp"

namespace pf_resampling {
namespace {

// The bits of positive doubles order like the doubles. They are sorted in two goes, the upper ones
// first, each together with the particle's index in one word: (bits << kIndexBits) + index.
constexpr int kIndexBits = 31;
constexpr int kUpperBits = 64 - kIndexBits;
constexpr std::uint64_t kIndexMask = (std::uint64_t{1} << kIndexBits) - 1;

// Stable radix sort of words by the `bits` above the index.
void sort_words(std::uint64_t* words, std::uint64_t* swap, std::int64_t size, int bits) {
  // Small digits for few words, where counting would cost more than moving.
  const int digit_bits = size < 8192 ? 8 : 11;
  constexpr int kMostDigits = 5;
  constexpr int kMostBuckets = 2048;
  const int digits = (bits + digit_bits - 1) / digit_bits;
  const std::uint64_t mask = (std::uint64_t{1} << digit_bits) - 1;
  int starts[kMostDigits][kMostBuckets];
  for (int digit = 0; digit < digits; ++digit) {
    std::fill(starts[digit], starts[digit] + mask + 1, 0);
  }
  for (std::int64_t i = 0; i < size; ++i) {
    std::uint64_t rest = words[i] >> kIndexBits;
    for (int digit = 0; digit < digits; ++digit) {
      ++starts[digit][rest & mask];
      rest >>= digit_bits;
    }
  }
  std::uint64_t* from = words;
  std::uint64_t* to = swap;
  for (int digit = 0; digit < digits; ++digit) {
    const int shift = kIndexBits + digit * digit_bits;
    int* start = starts[digit];
    if (start[(from[0] >> shift) & mask] == size) continue;  // they all share this digit
    int sum = 0;
    for (std::uint64_t bucket = 0; bucket <= mask; ++bucket) {
      const int count = start[bucket];
      start[bucket] = sum;
      sum += count;
    }
    for (std::int64_t i = 0; i < size; ++i) to[start[(from[i] >> shift) & mask]++] = from[i];
    std::swap(from, to);
  }
  if (from != words) std::copy(from, from + size, words);
}

std::int64_t particle_of(std::uint64_t word) {
  return static_cast<std::int64_t>(word & kIndexMask);
}

// Particles of positive weight in ascending order of weight, as the low bits of work->sort_words.
// Returns how many they are. O(N).
std::int64_t sort_positive(const double* weights, std::int64_t size, ResamplingWorkspace* work) {
  std::uint64_t* words = grow(&work->sort_words, size);
  std::uint64_t* swap = grow(&work->sort_words_swap, size);
  std::int64_t positive = 0;
  std::uint64_t low = ~std::uint64_t{0};
  std::uint64_t high = 0;
  for (std::int64_t i = 0; i < size; ++i) {
    const std::uint64_t bits = to_bits(weights[i]);
    const bool is_positive = weights[i] > 0.0;
    words[positive] = static_cast<std::uint64_t>(i);
    positive += is_positive ? 1 : 0;
    low = is_positive && bits < low ? bits : low;
    high = is_positive && bits > high ? bits : high;
  }
  const int significant = high > low ? 64 - __builtin_clzll(high - low) : 1;
  const int lower_bits = std::max(0, significant - kUpperBits);
  for (std::int64_t i = 0; i < positive; ++i) {
    const std::uint64_t bits = to_bits(weights[words[i]]) - low;
    words[i] |= (bits >> lower_bits) << kIndexBits;
  }
  sort_words(words, swap, positive, significant - lower_bits);
  if (lower_bits == 0) return positive;
  // Where the upper bits are equal the lower ones decide: few at a time, if they are not equal,
  // too.
  const std::uint64_t lower_mask = (std::uint64_t{1} << lower_bits) - 1;
  for (std::int64_t first = 0; first < positive;) {
    const std::uint64_t upper = words[first] >> kIndexBits;
    std::int64_t end = first + 1;
    while (end < positive && words[end] >> kIndexBits == upper) ++end;
    if (end - first > 1) {
      for (std::int64_t i = first; i < end; ++i) {
        const std::uint64_t index = words[i] & kIndexMask;
        words[i] = (((to_bits(weights[index]) - low) & lower_mask) << kIndexBits) | index;
      }
      if (end - first > 32) {
        sort_words(words + first, swap, end - first, lower_bits);
      } else {
        std::sort(words + first, words + end);
      }
    }
    first = end;
  }
  return positive;
}

PF_RESAMPLING_VECTOR_CLONES
void log_ratios(const double* weights, const double* probabilities, std::int64_t size,
                double* out) {
  for (std::int64_t i = 0; i < size; ++i) {
    out[i] = log_any_vector(weights[i] / (weights[i] > 0.0 ? probabilities[i] : 1.0));
  }
}

}  // namespace

// Kwak eq. 3, linear ranking: p_k = (eta_max - (eta_max - eta_min) (rank_k - 1) / (n - 1)) / n with
// eta_min = 2 - eta_max, rank 1 for the largest weight. Kwak leaves ties and n = 1 open: particles
// of equal weight share the mean of their ranks, and one alone has p = 1. Particles of weight zero
// are not ranked: they are impossible, and eq. 3 would bring them back to life.
void rank_based(const ScaledWeights& weights, const ResamplingOptions& options,
                const RandomStream& stream, ResamplingWorkspace* work, int* counts) {
  const std::int64_t ranked = sort_positive(weights.weights, weights.size, work);
  const std::uint64_t* words = work->sort_words.data();
  double* probabilities = grow(&work->inner_weights, weights.size);
  std::fill(probabilities, probabilities + weights.size, 0.0);
  const double n = static_cast<double>(ranked);
  const double slope = ranked > 1 ? (2.0 * options.rank_max - 2.0) / (n - 1.0) : 0.0;
  const double top = ranked > 1 ? options.rank_max : 1.0;
  for (std::int64_t first = 0; first < ranked;) {
    // Weights, which lie anywhere, are looked at only where the words do not tell them apart.
    const auto ties = [&](std::int64_t i) {
      return words[i] >> kIndexBits == words[first] >> kIndexBits &&
             weights.weights[particle_of(words[i])] == weights.weights[particle_of(words[first])];
    };
    std::int64_t end = first + 1;
    while (end < ranked && ties(end)) ++end;
    const double mean_rank = n - 0.5 * static_cast<double>(first + end - 1);
    const double probability = (top - slope * (mean_rank - 1.0)) / n;
    for (std::int64_t i = first; i < end; ++i) probabilities[particle_of(words[i])] = probability;
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
  for (int slot = 0; slot < size; ++slot) log_weights[slot] = log_after[ancestors[slot]];
  Eigen::Map<Eigen::ArrayXd> linear(grow(&work->rescaled_inner, size), size);
  normalize(Eigen::Map<Eigen::ArrayXd>(log_weights, size), linear);
}

}  // namespace pf_resampling
