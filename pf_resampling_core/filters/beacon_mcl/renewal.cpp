// Renewal of the population: selection or compensation, excitation, injection where the robot was
// carried off.
#include <algorithm>
#include <cmath>

#include "pf_resampling_core/filters/beacon_mcl/beacon_mcl.hpp"

namespace pf_resampling {

void BeaconMcl::renew() {
  const auto select = [this](ConstIndices ancestors) {
    select_columns(ancestors, &particles_, pool_.get());
    ancestry_.select(ancestors);
  };
  // In a cloud that is all wrong every particle fits as badly as the others: their weights stay
  // equal, and N_eff says that all is well. So recovery may renew before it is due.
  const RenewalOutcome outcome = strategy_.renew(
      status_.effective_sample_size, options_.particles, recovery_is_due(),
      [this](RandomPurpose purpose) { return stream(purpose); },
      population_of(&particles_, select,
                    [this](const std::vector<BlendPair>& pairs) { blend(pairs); }));
  status_.renewed = outcome.renewed;
  if (!outcome.renewed) return;
  status_.renewals = strategy_.renewals();
  status_.distinct_ancestors_of_renewal = outcome.distinct_ancestors;
  status_.distinct_ancestors_since_start = ancestry_.distinct();
  inject();
  vary_noise_factors();
}

// Pose, and what the particle has learnt: its Kalman filters, and its factors of the noise, which
// are log-normal.
void BeaconMcl::blend(const std::vector<BlendPair>& pairs) {
  BeaconMclParticles& p = particles_;
  const CovarianceTreatment treatment = options_.strategy.compensation.covariance;
  blend_poses(pairs, p.x, p.y, p.heading);
  blend_covariances(pairs, treatment, p.yaw_rate_bias, p.yaw_rate_bias, p.yaw_rate_bias_variance);
  blend_means(pairs, p.yaw_rate_bias);
  for (Eigen::ArrayXd* factor : {&p.translation_factor, &p.heading_factor}) {
    for (const BlendPair& pair : pairs) {
      double& low = (*factor)[pair.low];
      low = std::exp(pair.share * std::log(low) +
                     pair.share_of_high() * std::log((*factor)[pair.high]));
    }
  }
  blend_covariances(pairs, treatment, p.scale, p.scale, p.scale_variance);
  blend_covariances(pairs, treatment, p.scale, p.bias, p.scale_bias_covariance);
  blend_covariances(pairs, treatment, p.bias, p.bias, p.bias_variance);
  blend_means(pairs, p.scale);
  blend_means(pairs, p.bias);
}

bool BeaconMcl::recovery_is_due() const {
  const RecoveryOptions& recovery = options_.recovery;
  return recovery.enabled &&
         progress_.fast_likelihood < recovery.threshold * progress_.slow_likelihood;
}

void BeaconMcl::inject() {
  if (!recovery_is_due()) return;
  const RecoveryOptions& recovery = options_.recovery;
  const double drop =
      1.0 - progress_.fast_likelihood / (recovery.threshold * progress_.slow_likelihood);
  const Eigen::Index size = particles_.size();
  const int count = static_cast<int>(
      std::floor(std::min(drop, recovery.maximum_share) * static_cast<double>(size)));
  if (count < 1) return;
  const std::vector<Pose2> proposals = propose_from_ranges(count);
  // Spread evenly over the slots, from a random offset: after a selection neighbours may be copies
  // of one another.
  const double offset = stream(RandomPurpose::injection).uniform(0);
  for (std::size_t i = 0; i < proposals.size(); ++i) {
    const double position =
        (static_cast<double>(i) + offset) / static_cast<double>(proposals.size());
    const Eigen::Index slot =
        std::min(size - 1, static_cast<Eigen::Index>(position * static_cast<double>(size)));
    particles_.put(slot, proposals[i]);
  }
  status_.injected += static_cast<std::int64_t>(proposals.size());
}

}  // namespace pf_resampling
