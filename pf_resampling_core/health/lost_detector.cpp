#include "pf_resampling_core/health/lost_detector.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

// Weight of a new innovation in their running mean.
constexpr double kInnovationRate = 0.05;
// No observation, and no time, makes certain.
constexpr double kLeast = 1e-6;

}  // namespace

LostDetector::LostDetector(const LostDetectorOptions& options) : options_(options) {
  const bool possible =
      options.lost_spread > 1.0 && options.time_to_loss > 0.0 && options.time_to_recovery > 0.0;
  if (!possible) {
    throw Error("lost detector: lost spread " + std::to_string(options.lost_spread) +
                " has to be above 1, the times " + std::to_string(options.time_to_loss) +
                " s and " + std::to_string(options.time_to_recovery) + " s above 0");
  }
  reset();
}

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
  const double loses = 1.0 - std::exp(-elapsed / options_.time_to_loss);
  const double recovers = 1.0 - std::exp(-elapsed / options_.time_to_recovery);
  const double before = probability_ * (1.0 - recovers) + (1.0 - probability_) * loses;

  const double spread = options_.lost_spread;
  const double when_lost =
      std::pow(spread, -dimensions) * std::exp(-0.5 * squared_distance / (spread * spread));
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
