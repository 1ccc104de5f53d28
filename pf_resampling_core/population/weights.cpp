#include "pf_resampling_core/population/weights.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/population/lanes.hpp"
#include "pf_resampling_core/population/vector_math.hpp"

namespace pf_resampling {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::int64_t kBlock = 256;  // a multiple of kLanes

// The last values, fewer than eight, filled up.
PF_RESAMPLING_INLINE void fill_up(const double* values, std::int64_t size, double filling,
                                  double* lanes) {
  for (int lane = 0; lane < kLanes; ++lane) lanes[lane] = lane < size ? values[lane] : filling;
}

template <typename R>
struct Examined {
  typename R::Doubles maximum[R::kParts];
  typename R::Integers unusable[R::kParts];
};

template <typename R>
PF_RESAMPLING_INLINE void examine(const double* values, Examined<R>* all) {
#pragma GCC unroll 4
  for (int part = 0; part < R::kParts; ++part) {
    typename R::Doubles lanes;
    std::memcpy(&lanes, values + part * R::kWidth, sizeof lanes);
    all->maximum[part] = lanes > all->maximum[part] ? lanes : all->maximum[part];
    // NaN and +infinity are what is not below infinity.
    all->unusable[part] |= ~(lanes < kInfinity);
  }
}

template <int kBytes>
PF_RESAMPLING_INLINE void maximum_in(const double* values, std::int64_t size, double* maximum) {
  using R = Registers<kBytes>;
  Examined<R> all;
  for (int part = 0; part < R::kParts; ++part) {
    all.maximum[part] = typename R::Doubles{} - kInfinity;
    all.unusable[part] = typename R::Integers{};
  }
  std::int64_t i = 0;
  for (; i + kLanes <= size; i += kLanes) examine<R>(values + i, &all);
  if (i < size) {
    double lanes[kLanes];
    fill_up(values + i, size - i, -kInfinity, lanes);
    examine<R>(lanes, &all);
  }
  double maxima[kLanes];
  std::int64_t unusable[kLanes];
  std::memcpy(maxima, all.maximum, sizeof maxima);
  std::memcpy(unusable, all.unusable, sizeof unusable);
  *maximum = *std::max_element(maxima, maxima + kLanes);
  for (const std::int64_t lane : unusable) *maximum = lane != 0 ? kInfinity : *maximum;
}

// The largest value; +infinity when some are NaN or +infinity.
PF_RESAMPLING_BY_WIDTH(maximum_if_usable, maximum_in,
                       (const double* values, std::int64_t size, double* maximum),
                       (values, size, maximum))

// Adds the sums over a block, whose arrays are filled up with zeros to a multiple of kLanes.
template <int kBytes>
PF_RESAMPLING_INLINE void add_block_in(const double* weights, const double* logs, std::int64_t size,
                                       WeightSums* sums) {
  using R = Registers<kBytes>;
  typename R::Doubles sum[R::kParts] = {};
  typename R::Doubles squares[R::kParts] = {};
  typename R::Doubles weighted_logs[R::kParts] = {};
  for (std::int64_t i = 0; i < size; i += kLanes) {
#pragma GCC unroll 4
    for (int part = 0; part < R::kParts; ++part) {
      typename R::Doubles weight;
      typename R::Doubles log;
      std::memcpy(&weight, weights + i + part * R::kWidth, sizeof weight);
      std::memcpy(&log, logs + i + part * R::kWidth, sizeof log);
      sum[part] += weight;
      squares[part] += weight * weight;
      // A weight of zero may have a logarithm of -infinity.
      const typename R::Doubles product = weight * log;
      weighted_logs[part] += weight > 0.0 ? product : typename R::Doubles{};
    }
  }
  double lanes[kLanes];
  std::memcpy(lanes, sum, sizeof lanes);
  for (int lane = 0; lane < kLanes; ++lane) sums->weights[lane] += lanes[lane];
  std::memcpy(lanes, squares, sizeof lanes);
  for (int lane = 0; lane < kLanes; ++lane) sums->squares[lane] += lanes[lane];
  std::memcpy(lanes, weighted_logs, sizeof lanes);
  for (int lane = 0; lane < kLanes; ++lane) sums->weighted_logs[lane] += lanes[lane];
}

PF_RESAMPLING_BY_WIDTH(add_block, add_block_in,
                       (const double* weights, const double* logs, std::int64_t size,
                        WeightSums* sums),
                       (weights, logs, size, sums))

PF_RESAMPLING_VECTOR_CLONES
void exponentials_of_block(const double* log_weights, double shift, std::int64_t size,
                           double* shifted, double* linear) {
  for (std::int64_t i = 0; i < size; ++i) {
    const double value = log_weights[i] - shift;
    shifted[i] = value;
    linear[i] = exp_vector(value);
  }
}

PF_RESAMPLING_VECTOR_CLONES
double sum_of_squares(const double* values, std::int64_t size) {
  double lanes[kLanes] = {};
  std::int64_t i = 0;
  for (; i + kLanes <= size; i += kLanes) {
    for (int lane = 0; lane < kLanes; ++lane) lanes[lane] += values[i + lane] * values[i + lane];
  }
  for (int lane = 0; i < size; ++i, ++lane) lanes[lane] += values[i] * values[i];
  return sum_of_lanes(lanes);
}

bool is_finite(double value) {
  return value > -kInfinity && value < kInfinity;
}

}  // namespace

bool is_normalizable(ConstArray log_weights) {
  double maximum = kInfinity;
  maximum_if_usable(log_weights.data(), log_weights.size(), &maximum);
  return is_finite(maximum);
}

void exponentials(const double* log_weights, double shift, std::int64_t size, double* linear,
                  WeightSums* sums) {
  double shifted[kBlock];
  double last[kLanes];
  double last_shifted[kLanes];
  for (std::int64_t begin = 0; begin < size; begin += kBlock) {
    const std::int64_t count = std::min(kBlock, size - begin);
    const std::int64_t whole = count / kLanes * kLanes;
    double* out = linear + begin;
    exponentials_of_block(log_weights + begin, shift, count, shifted, out);
    add_block(out, shifted, whole, sums);
    if (whole < count) {
      fill_up(out + whole, count - whole, 0.0, last);
      fill_up(shifted + whole, count - whole, 0.0, last_shifted);
      add_block(last, last_shifted, kLanes, sums);
    }
  }
}

void add(const WeightSums& other, WeightSums* sums) {
  for (int lane = 0; lane < kLanes; ++lane) {
    sums->weights[lane] += other.weights[lane];
    sums->squares[lane] += other.squares[lane];
    sums->weighted_logs[lane] += other.weighted_logs[lane];
  }
}

WeightSummary summary_of(const WeightSums& sums, double shift, std::int64_t size,
                         double* inverse_sum) {
  const double sum = sum_of_lanes(sums.weights);
  const double log_of_sum = log_vector(sum);
  WeightSummary summary;
  summary.log_sum = shift + log_of_sum;
  *inverse_sum = 1.0 / sum;
  const double largest = static_cast<double>(size);
  const double effective = sum * sum / sum_of_lanes(sums.squares);
  summary.effective_sample_size = std::min(std::max(effective, 1.0), largest);
  // Entropy: -sum w/S log(w/S) = log S - (sum w log w) / S.
  const double entropy = log_of_sum - sum_of_lanes(sums.weighted_logs) / sum;
  summary.entropy_sample_size = std::min(std::max(exp_vector(entropy), 1.0), largest);
  return summary;
}

PF_RESAMPLING_VECTOR_CLONES
void rescale(double inverse_sum, double log_sum, std::int64_t size, double* linear,
             double* log_weights) {
  for (std::int64_t i = 0; i < size; ++i) {
    linear[i] *= inverse_sum;
    log_weights[i] -= log_sum;
  }
}

WeightSummary normalize(MutableArray log_weights, MutableArray linear) {
  if (log_weights.size() != linear.size()) {
    throw Error("normalize: " + std::to_string(log_weights.size()) + " log-weights but room for " +
                std::to_string(linear.size()) + " weights; give arrays of one size");
  }
  const std::int64_t size = log_weights.size();
  double shift = kInfinity;
  maximum_if_usable(log_weights.data(), size, &shift);
  if (!is_finite(shift)) {
    throw Error(
        "normalize: there are no log-weights, or one is NaN or +infinity, or all are -infinity; "
        "reset them to uniform");
  }
  WeightSums sums;
  exponentials(log_weights.data(), shift, size, linear.data(), &sums);
  double inverse_sum = 1.0;
  const WeightSummary summary = summary_of(sums, shift, size, &inverse_sum);
  rescale(inverse_sum, summary.log_sum, size, linear.data(), log_weights.data());
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
