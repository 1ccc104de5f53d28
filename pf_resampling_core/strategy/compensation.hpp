#pragma once

#include <Eigen/Core>
#include <vector>

#include "pf_resampling_core/parameters/parameters.hpp"
#include "pf_resampling_core/population/random_stream.hpp"
#include "pf_resampling_core/population/weights.hpp"

namespace pf_resampling {

/// How a weak particle finds the strong one it is blended with (Kwak Table V).
enum class Pairing {
  rank,      ///< the worst with the best, the second worst with the second best, ...
  random,    ///< any of the strong half
  roulette,  ///< one of the strong half, with probability in proportion to its weight
};
const EnumNames<Pairing>& names_of(Pairing);

/// By which weights a pair is blended.
enum class Blend {
  normalized,  ///< those of the two, divided by their sum, so that the result lies between them
  literal,  ///< Kwak eqs. 7 and 8 as printed: the two shares do not sum to one, and what is blended
            ///< goes towards the origin, so that the filter diverges
};
const EnumNames<Blend>& names_of(Blend);

/// What becomes of the covariance of what is blended: landmarks, calibration, yaw-rate bias.
enum class CovarianceTreatment {
  keep,            ///< the weak particle's own (Kwak section 5.1)
  moment_matched,  ///< a·Σ_l + b·Σ_h + a·b·d·dᵀ, d the difference of the means
};
const EnumNames<CovarianceTreatment>& names_of(CovarianceTreatment);

/// The weights after a compensation.
enum class CompensatedWeights {
  reset,      ///< all 1/M (Kwak)
  pair_mean,  ///< both of a pair get the mean of their weights; a strong one with several weak ones
              ///< shares the mean with all of them
};
const EnumNames<CompensatedWeights>& names_of(CompensatedWeights);

struct CompensationOptions {
  Pairing pairing = Pairing::rank;
  /// Share of the weak half that is compensated, worst first, in [0, 1] (Kwak Table VI); rounded to
  /// the nearest whole number of particles, and at least one unless it is 0: then none is, and the
  /// weights alone change, which is the control for what is said of compensation.
  double ratio = 1.0;
  Blend blend = Blend::normalized;
  CovarianceTreatment covariance = CovarianceTreatment::keep;
  CompensatedWeights weights_after = CompensatedWeights::reset;
};

/// The parameters population/compensation/..., bound to `options`, which must outlive the list.
void add_parameters(CompensationOptions* options, ParameterList* parameters);

/// One weak particle to be blended with a strong one: low <- share·low + (total - share)·high
/// (Kwak eqs. 7 and 8).
struct BlendPair {
  int low = 0;
  int high = 0;
  double share = 0.0;  ///< w_low / (w_low + w_high), in [0, 1/2]; Blend::literal: w_low
  double total = 1.0;  ///< Blend::literal: w_low + w_high

  double share_of_high() const { return total - share; }
};

/// What is to be blended with what. Nothing is rejected: every particle keeps its slot.
struct CompensationResult {
  std::vector<BlendPair> pairs;  ///< every low at most once, no low is a high
  Eigen::ArrayXd log_weights;    ///< normalised, afterwards
};

/// Compensation instead of resampling (Kwak section 5). Weak are the particles below the median
/// weight: the first ⌊M/2⌋ in ascending order of weight, ties by slot; the others are strong.
/// `weights`: normalised, linear, at least one. Two particles of weight zero share equally. Uniform
/// number i of the stream chooses the partner of the i-th worst (`random`, `roulette`). O(M log M).
/// Throws Error on weights that are empty, negative, not finite or all zero, and on a ratio outside
/// its range.
CompensationResult compensate(const CompensationOptions& options, ConstArray weights,
                              const RandomStream& stream);

/// Throws Error unless the pairs may be blended among so many particles: slots within range, every
/// low at most once and no high, shares in [0, total], totals in [0, 1]. O(M).
void check_pairs(const std::vector<BlendPair>& pairs, int particles);

/// Blends poses: positions linearly, headings along the shorter arc, to [-pi, pi]. x, y, heading of
/// all particles, m and rad, of equal size. Throws Error, changing nothing, as check_pairs() does.
///
/// One rule holds for all filters: whatever a particle has learnt is blended as its pose is, means
/// by blend_means(), covariances by blend_covariances() before their means.
void blend_poses(const std::vector<BlendPair>& pairs, MutableArray x, MutableArray y,
                 MutableArray heading);

/// Blends a number that every particle has. The pairs have been checked.
void blend_means(const std::vector<BlendPair>& pairs, MutableArray values);

/// Blends the covariance of two numbers, whose means `first` and `second` are not blended yet; of
/// one number with itself: its variance. The pairs have been checked.
void blend_covariances(const std::vector<BlendPair>& pairs, CovarianceTreatment treatment,
                       ConstArray first, ConstArray second, MutableArray covariances);

}  // namespace pf_resampling
