#include "pf_resampling_core/health/lost_detector.hpp"

#include <algorithm>
#include <cmath>

namespace pf_resampling {
namespace {

// Weight of a new innovation in their running mean.
constexpr double kInnovationRate = 0.05;
// No observation, and no time, makes certain.
constexpr double kLeast = 1e-6;
constexpr double kLostSpread = 10.0;      // of innovations, in their expected deviations
constexpr double kTimeToLoss = 3600.0;    // s, mean, from right to lost
constexpr double kTimeToRecovery = 60.0;  // s, mean, back

}  // namespace

void LostDetector::reset() {
  probability_ = kLeast;
  normalized_innovation_ = 1.0;
}

void LostDetector::observe(double squared_distance, int dimensions, double duration,
                           double outlier_share) {
  if (!std::isfinite(squared_distance) || squared_distance < 0.0 || dimensions < 1) return;
  normalized_innovation_ +=
      kInnovationRate * (squared_distance / dimensions - normalized_innovation_);

  const double elapsed = std::isfinite(duration) ? std::max(0.0, duration) : 0.0;
  const double loses = 1.0 - std::exp(-elapsed / kTimeToLoss);
  const double recovers = 1.0 - std::exp(-elapsed / kTimeToRecovery);
  const double before = probability_ * (1.0 - recovers) + (1.0 - probability_) * loses;

  const double when_lost = std::pow(kLostSpread, -dimensions) *
                           std::exp(-0.5 * squared_distance / (kLostSpread * kLostSpread));
  const double when_right =
      (1.0 - outlier_share) * std::exp(-0.5 * squared_distance) + outlier_share * when_lost;
  const double lost = before * when_lost;
  const double right = (1.0 - before) * when_right;
  // So far out that both are zero: it says as much as the farthest that is not.
  const double odds = lost + right > 0.0 ? lost / (lost + right)
                                         : before / (before + (1.0 - before) * outlier_share);
  probability_ = std::clamp(odds, kLeast, 1.0 - kLeast);
}

}  // namespace pf_resampling
