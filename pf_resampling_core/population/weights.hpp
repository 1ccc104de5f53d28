#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace pf_resampling {

using ConstArray = Eigen::Ref<const Eigen::ArrayXd>;
using MutableArray = Eigen::Ref<Eigen::ArrayXd>;

/// What a set of weights says of the health of the filter.
struct WeightSummary {
  double log_sum = 0.0;                ///< log of the sum of the weights before normalisation
  double effective_sample_size = 0.0;  ///< 1 / sum of squares (Kwak eq. 4), in [1, size]
  double entropy_sample_size = 0.0;    ///< exp of the Shannon entropy, in [1, size]
};

/// Whether there is a distribution in these log-weights: at least one, none NaN or +infinity, not
/// all -infinity.
bool is_normalizable(ConstArray log_weights);

/// Normalised linear weights from log-weights, by subtraction of the maximum (log-sum-exp):
/// linear[i] >= 0, sum 1. Sizes equal. The log-weights are brought to sum one as well. A sum over
/// blocks of fixed size, so the result does not depend on the machine's vector width. Throws Error,
/// before anything is changed, when !is_normalizable(log_weights).
WeightSummary normalize(MutableArray log_weights, MutableArray linear);

/// normalize() in parts, for callers that share blocks of particles out to threads: weights that
/// are not normalised and their sums, in eight lanes whose order is the same everywhere.
struct WeightSums {
  double weights[8] = {};
  double squares[8] = {};
  double weighted_logs[8] = {};
};
/// linear = e^(log_weights - shift), added to the sums.
void exponentials(const double* log_weights, double shift, std::int64_t size, double* linear,
                  WeightSums* sums);
void add(const WeightSums& other, WeightSums* sums);
/// What the sums of all `size` weights say, and what brings the weights to sum one: log_sum off the
/// logarithms, the factor `inverse_sum` on the others.
WeightSummary summary_of(const WeightSums& sums, double shift, std::int64_t size,
                         double* inverse_sum);
void rescale(double inverse_sum, double log_sum, std::int64_t size, double* linear,
             double* log_weights);

/// Takes up a share of what was added to the log-weights since `before`: before + share *
/// (log_weights
/// - before), with `share` in (0, 1]; 1 changes nothing. Sizes equal. Returns the log of how much
/// the sum of the weights became smaller, which is 0 for log-weights that are not normalizable:
/// these stay as they are.
double temper(double share, ConstArray before, MutableArray log_weights);

/// Kwak eq. 4 for normalised linear weights.
double effective_sample_size(ConstArray linear);

}  // namespace pf_resampling
