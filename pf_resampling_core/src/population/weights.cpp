#include "pf_resampling_core/population/weights.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/population/vector_math.hpp"

namespace pf_resampling {
namespace {

// Sums run in this many interleaved partial sums, which fixes their order for every vector width.
constexpr int kLanes = 8;

PF_RESAMPLING_VECTOR_CLONES
double maximum(const double* values, std::int64_t size) {
  double best[kLanes];
  for (int lane = 0; lane < kLanes; ++lane) best[lane] = -std::numeric_limits<double>::infinity();
  std::int64_t i = 0;
  for (; i + kLanes <= size; i += kLanes) {
    for (int lane = 0; lane < kLanes; ++lane) {
      best[lane] = values[i + lane] > best[lane] ? values[i + lane] : best[lane];
    }
  }
  for (; i < size; ++i) best[0] = values[i] > best[0] ? values[i] : best[0];
  return *std::max_element(best, best + kLanes);
}

// NaN and infinity are the values that differ from themselves times zero.
PF_RESAMPLING_VECTOR_CLONES
std::int64_t count_unusable(const double* values, std::int64_t size) {
  std::int64_t count = 0;
  for (std::int64_t i = 0; i < size; ++i) {
    const std::uint64_t bits = to_bits(values[i]);
    const std::uint64_t magnitude = bits & 0x7fffffffffffffffu;
    const bool nan = magnitude > 0x7ff0000000000000u;
    const bool positive_infinity = bits == 0x7ff0000000000000u;
    count += (nan || positive_infinity) ? 1 : 0;
  }
  return count;
}

PF_RESAMPLING_VECTOR_CLONES
double exponentials(const double* log_weights, double shift, std::int64_t size, double* linear) {
  double sums[kLanes] = {};
  std::int64_t i = 0;
  for (; i + kLanes <= size; i += kLanes) {
    for (int lane = 0; lane < kLanes; ++lane) {
      const double value = exp_vector(log_weights[i + lane] - shift);
      linear[i + lane] = value;
      sums[lane] += value;
    }
  }
  for (; i < size; ++i) {
    linear[i] = exp_vector(log_weights[i] - shift);
    sums[0] += linear[i];
  }
  return ((sums[0] + sums[4]) + (sums[1] + sums[5])) + ((sums[2] + sums[6]) + (sums[3] + sums[7]));
}

PF_RESAMPLING_VECTOR_CLONES
void scale_and_sum(double inverse_sum, double log_sum, std::int64_t size, double* linear,
                   double* log_weights, double* sum_of_squares, double* sum_of_w_log_w) {
  double squares[kLanes] = {};
  double entropies[kLanes] = {};
  std::int64_t i = 0;
  for (; i + kLanes <= size; i += kLanes) {
    for (int lane = 0; lane < kLanes; ++lane) {
      const double weight = linear[i + lane] * inverse_sum;
      const double log_weight = log_weights[i + lane] - log_sum;
      linear[i + lane] = weight;
      log_weights[i + lane] = log_weight;
      squares[lane] += weight * weight;
      entropies[lane] += weight > 0.0 ? weight * log_weight : 0.0;
    }
  }
  for (; i < size; ++i) {
    linear[i] *= inverse_sum;
    log_weights[i] -= log_sum;
    squares[0] += linear[i] * linear[i];
    entropies[0] += linear[i] > 0.0 ? linear[i] * log_weights[i] : 0.0;
  }
  *sum_of_squares = 0.0;
  *sum_of_w_log_w = 0.0;
  for (int lane = 0; lane < kLanes; ++lane) {
    *sum_of_squares += squares[lane];
    *sum_of_w_log_w += entropies[lane];
  }
}

}  // namespace

bool is_normalizable(ConstArray log_weights) {
  if (log_weights.size() == 0) return false;
  if (count_unusable(log_weights.data(), log_weights.size()) > 0) return false;
  return maximum(log_weights.data(), log_weights.size()) > -std::numeric_limits<double>::infinity();
}

WeightSummary normalize(MutableArray log_weights, MutableArray linear) {
  if (log_weights.size() != linear.size()) {
    throw Error("normalize: " + std::to_string(log_weights.size()) + " log-weights but room for " +
                std::to_string(linear.size()) + " weights; give arrays of one size");
  }
  if (!is_normalizable(log_weights)) {
    throw Error(
        "normalize: the log-weights hold NaN or +infinity, or all are -infinity; reset them to "
        "uniform");
  }
  const std::int64_t size = log_weights.size();
  const double shift = maximum(log_weights.data(), size);
  const double sum = exponentials(log_weights.data(), shift, size, linear.data());
  WeightSummary summary;
  summary.log_sum = shift + std::log(sum);
  double sum_of_squares = 0.0;
  double sum_of_w_log_w = 0.0;
  scale_and_sum(1.0 / sum, summary.log_sum, size, linear.data(), log_weights.data(),
                &sum_of_squares, &sum_of_w_log_w);
  const double largest = static_cast<double>(size);
  summary.effective_sample_size = std::min(std::max(1.0 / sum_of_squares, 1.0), largest);
  summary.entropy_sample_size = std::min(std::max(std::exp(-sum_of_w_log_w), 1.0), largest);
  return summary;
}

double effective_sample_size(ConstArray linear) {
  return 1.0 / linear.square().sum();
}

}  // namespace pf_resampling
