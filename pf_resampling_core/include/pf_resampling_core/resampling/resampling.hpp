#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "pf_resampling_core/population/ancestry.hpp"
#include "pf_resampling_core/population/random_stream.hpp"
#include "pf_resampling_core/population/weights.hpp"

namespace pf_resampling {

/// Every scheme of papers K and M, and two from beyond them. Names for users: to_string().
enum class ResamplingScheme {
  multinomial,               ///< M section II.A
  residual,                  ///< M section II.B
  systematic,                ///< K Table I, M section II.C
  residual_systematic,       ///< K Table II (Bolic, Djuric, Hong 2003)
  residual_then_systematic,  ///< M section II.D
  stratified,                ///< M section II.E
  partial,                   ///< K section 3.2
  rank_based,                ///< K eq. 3
  ssp,                       ///< Srinivasan sampling process (Gerber, Chopin, Whiteley 2019)
  killing,                   ///< Del Moral; as in Gerber, Chopin, Whiteley 2019
};

/// All schemes in the order of the enum, and their names as users write them
/// ("residual_systematic").
const std::vector<ResamplingScheme>& all_resampling_schemes();
std::string to_string(ResamplingScheme scheme);
/// Throws Error that lists the known names when `name` is none of them.
ResamplingScheme resampling_scheme_from_string(const std::string& name);

/// Weights after `partial` and `rank_based`, which select with probabilities other than the
/// weights.
enum class WeightsAfter {
  reset,     ///< all 1/M: what K's text says and its Table IV fits; biased
  unbiased,  ///< partial: the resampled mass shared equally among the resampled; rank_based: w/p,
             ///< renormalised
};
std::string to_string(WeightsAfter policy);
WeightsAfter weights_after_from_string(const std::string& name);

struct ResamplingOptions {
  ResamplingScheme scheme = ResamplingScheme::systematic;
  /// Scheme inside `partial` and `rank_based`; any but these two.
  ResamplingScheme inner_scheme = ResamplingScheme::systematic;
  double partial_high =
      2.0;  ///< T_h: weights above partial_high / M take part (K section 3.2); > partial_low
  double partial_low = 0.5;  ///< T_l: weights below partial_low / M take part; in [0, 1]
  double rank_max = 1.5;     ///< eta_max of K eq. 3, in [1, 2]
  WeightsAfter weights_after = WeightsAfter::unbiased;
};

/// What resampling did. The arrays live in the Resampler and hold until its next call.
struct ResamplingResult {
  Eigen::Map<const Eigen::ArrayXi>
      counts;  ///< size N: how often each input particle was taken; sum M
  Eigen::Map<const Eigen::ArrayXi>
      ancestors;  ///< size M: survivors keep their own slot (counts_to_ancestors)
  Eigen::Map<const Eigen::ArrayXd> log_weights;  ///< size M: normalised log-weights afterwards
};

/// Resampling with working space, so that nothing is allocated after the first call with the
/// largest sizes.
class Resampler {
 public:
  /// Throws Error for options outside their ranges, naming the option, its value and its range.
  explicit Resampler(const ResamplingOptions& options = {});

  /// Draws `size` ancestors from `weights`.
  ///
  /// weights: N normalised linear weights (finite, >= 0, sum 1 within 1e-9 * N; rescaled internally
  /// by their sum). size: M >= 1, may differ from N, save for `killing` and `partial`, which need M
  /// == N. stream: for the draws; the same stream gives the same result. Throws Error, changing
  /// nothing, on weights that are empty, negative, not finite or sum to zero. All schemes are
  /// unbiased, E[count_k] = M w_k, except rank_based (E = M p_k, K eq. 3) and, with weights taken
  /// together with the weights afterwards, `reset` after either of the two. O(N + M).
  ResamplingResult resample(ConstArray weights, int size, const RandomStream& stream);

  const ResamplingOptions& options() const { return options_; }

 private:
  ResamplingOptions options_;
  Eigen::ArrayXi counts_;
  Eigen::ArrayXi ancestors_;
  Eigen::ArrayXd log_weights_;
  Eigen::ArrayXd uniforms_;
  Eigen::ArrayXd work_;
  Eigen::ArrayXd inner_weights_;
  Eigen::ArrayXi inner_counts_;
  Eigen::ArrayXi order_;
};

}  // namespace pf_resampling
