#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "pf_resampling_core/parameters/parameters.hpp"
#include "pf_resampling_core/population/ancestry.hpp"
#include "pf_resampling_core/population/random_stream.hpp"
#include "pf_resampling_core/population/weights.hpp"

namespace pf_resampling {

/// Every scheme of Kwak (2008) and Mahmoud (2012), and two from beyond them. What is to be known of
/// each stands in one table, in resampling.cpp. To add one: a file in schemes/, a line here, and a
/// line there.
enum class ResamplingScheme {
  multinomial,               ///< Mahmoud section II.A
  residual,                  ///< Mahmoud section II.B
  systematic,                ///< Kwak Table I, Mahmoud section II.C
  residual_systematic,       ///< Kwak Table II (Bolic, Djuric, Hong 2003)
  residual_then_systematic,  ///< Mahmoud section II.D
  stratified,                ///< Mahmoud section II.E
  partial,                   ///< Kwak section 3.2
  rank_based,                ///< Kwak eq. 3
  ssp,                       ///< Srinivasan sampling process (Gerber, Chopin, Whiteley 2019)
  killing,                   ///< Del Moral; as in Gerber, Chopin, Whiteley 2019
};

const EnumNames<ResamplingScheme>& names_of(ResamplingScheme);
/// Those that may be inside another one.
const std::vector<ResamplingScheme>& inner_resampling_schemes();

/// Weights after `partial` and `rank_based`, which select with probabilities other than the
/// weights.
enum class WeightsAfter {
  reset,     ///< all 1/M: what Kwak's text says and what fits Kwak's Table IV; biased
  unbiased,  ///< partial: the resampled mass shared equally among the resampled; rank_based: w/p,
             ///< renormalised
};
const EnumNames<WeightsAfter>& names_of(WeightsAfter);

/// A scheme that the caller brings along: fills in how often each particle is taken. `weights`: as
/// Resampler::resample was given them, checked; `size`: copies to be made, the sum of the counts;
/// `counts`: all 0, of the weights' size.
using OwnScheme = std::function<void(ConstArray weights, int size, const RandomStream& stream,
                                     MutableIndices counts)>;

/// The function `resampling_scheme` of a shared library, extern "C" and with the arguments of
/// OwnScheme; the library stays loaded. `path`: as dlopen() takes it, so a name alone is looked for
/// in LD_LIBRARY_PATH. Throws Error, with the loader's reason, if there is no such library or it
/// has no such function.
OwnScheme scheme_of_library(const std::string& path);

struct ResamplingOptions {
  ResamplingScheme scheme = ResamplingScheme::systematic;
  /// Scheme inside `partial` and `rank_based`: one of inner_resampling_schemes().
  ResamplingScheme inner_scheme = ResamplingScheme::systematic;
  /// T_h of Kwak section 3.2: weights above partial_high / M take part; > partial_low.
  double partial_high = 2.0;
  double partial_low = 0.5;  ///< T_l: weights below partial_low / M take part; in [0, 1]
  double rank_max = 1.5;     ///< eta_max of Kwak eq. 3, in [1, 2]
  WeightsAfter weights_after = WeightsAfter::unbiased;
  /// Where it is set, from code, it takes the place of `scheme`; all copies weigh the same
  /// afterwards. See examples/own_scheme.
  OwnScheme own_scheme = nullptr;
  std::string library{};  ///< that own_scheme was loaded from by its parameter
};

/// The parameters population/resampling/..., bound to `options`, which must outlive the list.
void add_parameters(ResamplingOptions* options, ParameterList* parameters);

/// Whether resampling gives exactly as many particles as it gets: `partial` and `killing` do, and
/// `rank_based` with `killing` inside.
bool keeps_size(const ResamplingOptions& options);

/// What resampling did. The arrays live in the Resampler and hold until its next call, whether that
/// throws or not.
struct ResamplingResult {
  /// Size N: how often each input particle was taken; sum M.
  Eigen::Map<const Eigen::ArrayXi> counts;
  /// Size M: survivors keep their own slot, see counts_to_ancestors().
  Eigen::Map<const Eigen::ArrayXi> ancestors;
  /// Size M: normalised log-weights afterwards.
  Eigen::Map<const Eigen::ArrayXd> log_weights;
};

/// Working space of the schemes: grows to the largest size met, never shrinks.
struct ResamplingWorkspace {
  std::vector<double> rescaled;           ///< weights brought into range
  std::vector<double> rescaled_inner;     ///< the same for the inner scheme
  std::vector<double> inner_weights;      ///< what the scheme inside partial and rank_based sees
  std::vector<double> log_after;          ///< log-weight of a copy of each particle
  std::vector<int> moderate;              ///< partial: 1 for those that do not take part
  double shared_mass = 0.0;               ///< partial: S_hl, weight of those that take part
  int sharing = 0;                        ///< partial: how many take part
  std::vector<double> uniforms;           ///< draws
  std::vector<double> thresholds;         ///< sorted draws
  std::vector<int> draws_below;           ///< number of draws before each copy
  std::vector<std::uint64_t> sort_words;  ///< ranking
  std::vector<std::uint64_t> sort_words_swap;
};

/// Resampling with working space, so that nothing is allocated after the first call with the
/// largest sizes.
class Resampler {
 public:
  /// Throws Error for options outside their ranges, naming the option, its value and its range.
  explicit Resampler(const ResamplingOptions& options = {});

  /// Draws `size` ancestors from `weights`.
  ///
  /// weights: N linear weights, finite, >= 0, with a positive sum; they need not be normalised,
  /// only their ratios count. size: M >= 1, may differ from N unless keeps_size(options). stream:
  /// for the draws; the same stream gives the same result on every machine. Throws Error on weights
  /// that are empty, negative, not finite or sum to zero, on a size that the scheme cannot give,
  /// and on counts of own_scheme that are negative or do not sum to `size`. What own_scheme throws
  /// is passed on. O(N + M).
  ///
  /// E[counts_k] = M w_k for all schemes but two: `rank_based` has M p_k (Kwak eq. 3); in `partial`
  /// the moderate particles have 1 and the others share their slots by weight. After these two, it
  /// is counts and log-weights together that are unbiased, and under WeightsAfter::reset not even
  /// that. A particle of weight zero is never taken.
  ResamplingResult resample(ConstArray weights, int size, const RandomStream& stream);

  const ResamplingOptions& options() const { return options_; }

 private:
  ResamplingOptions options_;
  ResamplingWorkspace work_;
  std::vector<int> counts_;
  std::vector<int> ancestors_;
  std::vector<double> log_weights_;
  int equal_log_weights_ = 0;  // so many of log_weights_ hold -log(equal_log_weights_)
};

}  // namespace pf_resampling
