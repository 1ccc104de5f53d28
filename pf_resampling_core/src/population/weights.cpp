#include "pf_resampling_core/population/weights.hpp"

#include <algorithm>
#include <limits>

#include "lanes.hpp"
#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/population/vector_math.hpp"

namespace pf_resampling {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::int64_t kBlock = 256;  // a multiple of kLanes

// Eight values from `values`, or what is left of `size`, filled up.
PF_RESAMPLING_INLINE void load_up_to(const double* values, std::int64_t size, double filling,
                                     Doubles* lanes) {
  for (int lane = 0; lane < kLanes; ++lane) (*lanes)[lane] = lane < size ? values[lane] : filling;
}

PF_RESAMPLING_INLINE void examine_lanes(const Doubles& lanes, Doubles* maximum,
                                        Integers* unusable) {
  *maximum = lanes > *maximum ? lanes : *maximum;
  // NaN and +infinity are what is not below infinity.
  *unusable |= ~(lanes < kInfinity);
}

// The largest value; +infinity when some are NaN or +infinity.
PF_RESAMPLING_VECTOR_CLONES
double maximum_if_usable(const double* values, std::int64_t size) {
  Doubles maximum = Doubles{} - kInfinity;
  Integers unusable = {};
  std::int64_t i = 0;
  Doubles lanes = {};
  for (; i + kLanes <= size; i += kLanes) {
    load(values + i, &lanes);
    examine_lanes(lanes, &maximum, &unusable);
  }
  if (i < size) {
    load_up_to(values + i, size - i, -kInfinity, &lanes);
    examine_lanes(lanes, &maximum, &unusable);
  }
  bool usable = true;
  for (int lane = 0; lane < kLanes; ++lane) usable = usable && unusable[lane] == 0;
  return usable ? maximum_of(maximum) : kInfinity;
}

struct Sums {
  double weights = 0.0;
  double squares = 0.0;
  double weighted_logs = 0.0;
};

PF_RESAMPLING_INLINE void add_lanes(const Doubles& weights, const Doubles& logs, Doubles* sum,
                                    Doubles* squares, Doubles* weighted_logs) {
  *sum += weights;
  *squares += weights * weights;
  // A weight of zero may have a logarithm of -infinity.
  const Doubles product = weights * logs;
  *weighted_logs += weights > 0.0 ? product : Doubles{};
}

// linear = e^(log_weights - shift), and its sums.
PF_RESAMPLING_VECTOR_CLONES
void exponentials(const double* log_weights, double shift, std::int64_t size, double* linear,
                  Sums* sums) {
  Doubles sum = {};
  Doubles squares = {};
  Doubles weighted_logs = {};
  double shifted[kBlock];
  Doubles weights = {};
  Doubles logs = {};
  for (std::int64_t begin = 0; begin < size; begin += kBlock) {
    const std::int64_t count = std::min(kBlock, size - begin);
    double* out = linear + begin;
    for (std::int64_t i = 0; i < count; ++i) {
      const double value = log_weights[begin + i] - shift;
      shifted[i] = value;
      out[i] = exp_vector(value);
    }
    std::int64_t i = 0;
    for (; i + kLanes <= count; i += kLanes) {
      load(out + i, &weights);
      load(shifted + i, &logs);
      add_lanes(weights, logs, &sum, &squares, &weighted_logs);
    }
    if (i < count) {
      load_up_to(out + i, count - i, 0.0, &weights);
      load_up_to(shifted + i, count - i, 0.0, &logs);
      add_lanes(weights, logs, &sum, &squares, &weighted_logs);
    }
  }
  sums->weights = sum_of(sum);
  sums->squares = sum_of(squares);
  sums->weighted_logs = sum_of(weighted_logs);
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
  Doubles squares = {};
  Doubles lanes = {};
  std::int64_t i = 0;
  for (; i + kLanes <= size; i += kLanes) {
    load(values + i, &lanes);
    squares += lanes * lanes;
  }
  if (i < size) {
    load_up_to(values + i, size - i, 0.0, &lanes);
    squares += lanes * lanes;
  }
  return sum_of(squares);
}

bool is_finite(double value) {
  return value > -kInfinity && value < kInfinity;
}

}  // namespace

bool is_normalizable(ConstArray log_weights) {
  return log_weights.size() > 0 &&
         is_finite(maximum_if_usable(log_weights.data(), log_weights.size()));
}

WeightSummary normalize(MutableArray log_weights, MutableArray linear) {
  if (log_weights.size() != linear.size()) {
    throw Error("normalize: " + std::to_string(log_weights.size()) + " log-weights but room for " +
                std::to_string(linear.size()) + " weights; give arrays of one size");
  }
  const std::int64_t size = log_weights.size();
  const double shift = size > 0 ? maximum_if_usable(log_weights.data(), size) : kInfinity;
  if (!is_finite(shift)) {
    throw Error(
        "normalize: the log-weights are none, hold NaN or +infinity, or all are -infinity; reset "
        "them to uniform");
  }
  Sums sums;
  exponentials(log_weights.data(), shift, size, linear.data(), &sums);
  const double log_of_sum = log_vector(sums.weights);
  WeightSummary summary;
  summary.log_sum = shift + log_of_sum;
  rescale(1.0 / sums.weights, summary.log_sum, size, linear.data(), log_weights.data());
  const double largest = static_cast<double>(size);
  const double effective = sums.weights * sums.weights / sums.squares;
  summary.effective_sample_size = std::min(std::max(effective, 1.0), largest);
  // Entropy: -sum w/S log(w/S) = log S - (sum w log w) / S.
  const double entropy = log_of_sum - sums.weighted_logs / sums.weights;
  summary.entropy_sample_size = std::min(std::max(exp_vector(entropy), 1.0), largest);
  return summary;
}

double effective_sample_size(ConstArray linear) {
  return 1.0 / sum_of_squares(linear.data(), linear.size());
}

}  // namespace pf_resampling
