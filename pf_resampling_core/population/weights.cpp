#include "pf_resampling_core/population/weights.hpp"

#include <algorithm>
#include <limits>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/population/lanes.hpp"
#include "pf_resampling_core/population/vector_math.hpp"

namespace pf_resampling {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::int64_t kBlock = 256;  // a multiple of kLanes

// The largest value; +infinity when some are NaN or +infinity.
PF_RESAMPLING_VECTOR_CLONES
double maximum_if_usable(const double* values, std::int64_t size) {
  Doubles maxima = Doubles{} - kInfinity;
  Doubles lanes;
  Integers unusable = {};  // NaN and +infinity are what is not below infinity
  double last[kLanes];
  for (std::int64_t i = 0; i < size; i += kLanes) {
    if (i + kLanes <= size) {
      load(values + i, &lanes);
    } else {
      std::fill(std::copy(values + i, values + size, last), last + kLanes, -kInfinity);
      load(last, &lanes);
    }
    maxima = lanes > maxima ? lanes : maxima;
    unusable |= ~(lanes < kInfinity);
  }
  store(maxima, last);
  double maximum = *std::max_element(last, last + kLanes);
  for (int lane = 0; lane < kLanes; ++lane) maximum = unusable[lane] != 0 ? kInfinity : maximum;
  return maximum;
}

struct Sums {
  double weights[kLanes] = {};
  double squares[kLanes] = {};
  double weighted_logs[kLanes] = {};
};

// Adds the sums over a block, filled up with zeros to a multiple of kLanes.
PF_RESAMPLING_VECTOR_CLONES
void add_block(const double* weights, const double* logs, std::int64_t size, Sums* all) {
  Doubles sum = {};
  Doubles squares = {};
  Doubles weighted_logs = {};
  for (std::int64_t i = 0; i < size; i += kLanes) {
    Doubles weight;
    Doubles log;
    load(weights + i, &weight);
    load(logs + i, &log);
    sum += weight;
    squares += weight * weight;
    // A weight of zero may have a logarithm of -infinity.
    weighted_logs += weight > 0.0 ? weight * log : Doubles{};
  }
  for (int lane = 0; lane < kLanes; ++lane) {
    all->weights[lane] += sum[lane];
    all->squares[lane] += squares[lane];
    all->weighted_logs[lane] += weighted_logs[lane];
  }
}

PF_RESAMPLING_VECTOR_CLONES
void exponentials_of_block(const double* log_weights, double shift, std::int64_t size,
                           double* shifted, double* linear) {
  for (std::int64_t i = 0; i < size; ++i) {
    const double value = log_weights[i] - shift;
    shifted[i] = value;
    linear[i] = exp_vector(value);
  }
}

// linear = e^(log_weights - shift), and its sums.
void exponentials(const double* log_weights, double shift, std::int64_t size, double* linear,
                  Sums* sums) {
  double shifted[kBlock];
  for (std::int64_t begin = 0; begin < size; begin += kBlock) {
    const std::int64_t count = std::min(kBlock, size - begin);
    const std::int64_t whole = count / kLanes * kLanes;
    double* out = linear + begin;
    exponentials_of_block(log_weights + begin, shift, count, shifted, out);
    add_block(out, shifted, whole, sums);
    double last[kLanes] = {};
    double last_shifted[kLanes] = {};
    std::copy(out + whole, out + count, last);
    std::copy(shifted + whole, shifted + count, last_shifted);
    if (whole < count) add_block(last, last_shifted, kLanes, sums);
  }
}

PF_RESAMPLING_VECTOR_CLONES
void rescale(double inverse_sum, double log_sum, std::int64_t size, double* linear,
             double* log_weights) {
  for (std::int64_t i = 0; i < size; ++i) {
    linear[i] *= inverse_sum;
    log_weights[i] -= log_sum;
  }
}

PF_RESAMPLING_VECTOR_CLONES
double sum_of_squares(const double* values, std::int64_t size) {
  double squares[kLanes] = {};
  std::int64_t i = 0;
  for (; i + kLanes <= size; i += kLanes) {
    for (int lane = 0; lane < kLanes; ++lane) squares[lane] += values[i + lane] * values[i + lane];
  }
  for (; i < size; ++i) squares[i % kLanes] += values[i] * values[i];
  return sum_of_lanes(squares);
}

bool is_finite(double value) {
  return value > -kInfinity && value < kInfinity;
}

}  // namespace

bool is_normalizable(ConstArray log_weights) {
  return is_finite(maximum_if_usable(log_weights.data(), log_weights.size()));
}

WeightSummary normalize(MutableArray log_weights, MutableArray linear) {
  if (log_weights.size() != linear.size()) {
    throw Error("normalize: " + std::to_string(log_weights.size()) + " log-weights but room for " +
                std::to_string(linear.size()) + " weights; give arrays of one size");
  }
  const std::int64_t size = log_weights.size();
  const double shift = maximum_if_usable(log_weights.data(), size);
  if (!is_finite(shift)) {
    throw Error(
        "normalize: there are no log-weights, or one is NaN or +infinity, or all are -infinity; "
        "reset them to uniform");
  }
  Sums sums;
  exponentials(log_weights.data(), shift, size, linear.data(), &sums);
  const double sum = sum_of_lanes(sums.weights);
  const double log_of_sum = log_vector(sum);
  WeightSummary summary;
  summary.log_sum = shift + log_of_sum;
  rescale(1.0 / sum, summary.log_sum, size, linear.data(), log_weights.data());
  const double largest = static_cast<double>(size);
  const double effective = sum * sum / sum_of_lanes(sums.squares);
  summary.effective_sample_size = std::min(std::max(effective, 1.0), largest);
  // Entropy: -sum w/S log(w/S) = log S - (sum w log w) / S.
  const double entropy = log_of_sum - sum_of_lanes(sums.weighted_logs) / sum;
  summary.entropy_sample_size = std::min(std::max(exp_vector(entropy), 1.0), largest);
  return summary;
}

static double log_of_sum(ConstArray log_weights) {
  const double largest = log_weights.maxCoeff();
  return largest + std::log((log_weights - largest).exp().sum());
}

double temper(double share, ConstArray before, MutableArray log_weights) {
  if (share >= 1.0 || !is_normalizable(log_weights)) return 0.0;
  const double all = log_of_sum(log_weights);
  // A weight of zero stays one.
  log_weights = (before > -kInfinity).select(before + share * (log_weights - before), before);
  return all - log_of_sum(log_weights);
}

double effective_sample_size(ConstArray linear) {
  return 1.0 / sum_of_squares(linear.data(), linear.size());
}

}  // namespace pf_resampling
