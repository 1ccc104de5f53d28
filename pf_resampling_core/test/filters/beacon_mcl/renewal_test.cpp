// When BeaconMcl renews its population, what it carries on, and how many particles it has then.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "pf_resampling_core/test/filters/beacon_mcl/filter_testing.hpp"

namespace pf_resampling {
namespace {

TEST(BeaconMclRenewal, WithoutRenewalTheWeightsAreCarriedOn) {
  BeaconMclOptions never = default_options_with(300);
  never.strategy.schedule = Schedule::never;
  BeaconMclOptions none = default_options_with(300);
  none.strategy.schedule = Schedule::always;
  none.strategy.renewal = Renewal::none;
  for (const BeaconMclOptions& options : {never, none}) {
    const BeaconMcl filter = lived_in(options, 40);
    EXPECT_EQ(filter.status().renewals, 0);
    EXPECT_FALSE(filter.status().renewed);
    EXPECT_LT(filter.status().effective_sample_size, 290.0);
    EXPECT_NEAR(filter.particles().weight.sum(), 1.0, 1e-12);
    for (Eigen::Index i = 0; i < 300; ++i) EXPECT_EQ(filter.particles().ancestor[i], i);
  }
}

TEST(BeaconMclRenewal, SchedulesCountTheirRenewals) {
  BeaconMclOptions options = default_options_with(300);
  options.initialization.method = Initialization::uniform;
  options.strategy.schedule = Schedule::always;
  EXPECT_EQ(lived_in(options, 40).status().renewals, 40);
  options.strategy.schedule = Schedule::every_n;
  options.strategy.every_n = 7;
  EXPECT_EQ(lived_in(options, 40).status().renewals, 5);
  options.strategy.schedule = Schedule::effective_sample_size;
  options.strategy.threshold = 1.0;
  EXPECT_EQ(lived_in(options, 40).status().renewals, 40);
}

// Partial and rank-based resampling leave weights that differ; the filter has to go on with those
// (Kwak section 3.2). Belief before and after agree: the mean to within four deviations of a mean
// over half of the particles.
TEST(BeaconMclRenewal, WeightsAfterRenewalAreCarriedOn) {
  for (const ResamplingScheme scheme : {ResamplingScheme::partial, ResamplingScheme::rank_based}) {
    BeaconMclOptions options = plain_options();
    options.particles = 2000;
    options.ranges.sigma = 0.5;
    BeaconMclOptions renewing = options;
    renewing.strategy.schedule = Schedule::always;
    renewing.strategy.resampling.scheme = scheme;
    BeaconMcl carried(options, square_of_beacons(), 7);
    BeaconMcl renewed(renewing, square_of_beacons(), 7);
    carried.update({}, {range_of(1, 12.5)});
    renewed.update({}, {range_of(1, 12.5)});
    ASSERT_TRUE(renewed.status().renewed);
    const BeaconMclParticles& p = renewed.particles();
    EXPECT_GT(p.weight.maxCoeff(), 1.5 * p.weight.minCoeff()) << to_string(scheme);
    EXPECT_LT((p.weight - p.log_weight.exp()).abs().maxCoeff(), 1e-15);
    EXPECT_NEAR(p.weight.sum(), 1.0, 1e-12);
    const PoseEstimate before = carried.estimate();
    const PoseEstimate after = renewed.estimate();
    const double size = 0.5 * carried.status().effective_sample_size;
    EXPECT_NEAR(after.mean.x, before.mean.x, 4.0 * std::sqrt(before.covariance(0, 0) / size));
    EXPECT_NEAR(after.mean.y, before.mean.y, 4.0 * std::sqrt(before.covariance(1, 1) / size));
    const double relative = 4.0 * std::sqrt(2.0 / size);
    EXPECT_NEAR(after.covariance(0, 0) / before.covariance(0, 0), 1.0, relative);
  }
}

// Followed here by the slots that the particles say they come from.
TEST(BeaconMclRenewal, CountsAncestorsOfTheLastRenewalAndSinceTheStart) {
  BeaconMclOptions options = plain_options();
  options.particles = 100;
  options.strategy.schedule = Schedule::every_n;
  options.strategy.every_n = 2;
  BeaconMcl filter(options, square_of_beacons(), 7);
  std::vector<int> origins(100);
  for (int i = 0; i < 100; ++i) origins[static_cast<std::size_t>(i)] = i;
  int of_renewal = 100;
  for (int t = 0; t < 20; ++t) {
    filter.update({}, {range_of(1 + t % 4, 12.5)});
    if (filter.status().renewed) {
      const Eigen::ArrayXi& ancestor = filter.particles().ancestor;
      const std::vector<int> before = origins;
      for (std::size_t i = 0; i < 100; ++i) {
        origins[i] = before[static_cast<std::size_t>(ancestor[static_cast<Eigen::Index>(i)])];
      }
      of_renewal = static_cast<int>(
          std::set<int>(ancestor.data(), ancestor.data() + ancestor.size()).size());
    }
    const std::set<int> alive(origins.begin(), origins.end());
    EXPECT_EQ(filter.status().distinct_ancestors_of_renewal, of_renewal) << t;
    EXPECT_EQ(filter.status().distinct_ancestors_since_start, static_cast<int>(alive.size())) << t;
  }
  EXPECT_LT(filter.status().distinct_ancestors_since_start, of_renewal);
}

// The schedule goes by 1 / (sum of squared weights), which is below the exponential of the entropy:
// a threshold between the two renews.
TEST(BeaconMclRenewal, TheScheduleGoesByTheEffectiveSampleSize) {
  BeaconMclOptions options = plain_options();
  const auto after_a_range = [&] {
    BeaconMcl filter(options, square_of_beacons(), 7);
    filter.update({}, {range_of(1, 12.5)});
    return filter.status();
  };
  const BeaconMclStatus status = after_a_range();
  ASSERT_LT(status.effective_sample_size, status.entropy_sample_size - 1.0);
  options.strategy.schedule = Schedule::effective_sample_size;
  options.strategy.threshold =
      0.5 * (status.effective_sample_size + status.entropy_sample_size) / status.particles;
  EXPECT_TRUE(after_a_range().renewed);
  options.strategy.threshold = (status.effective_sample_size - 1.0) / status.particles;
  EXPECT_FALSE(after_a_range().renewed);
}

// Moments of a mixture of two, with the weights of their particles; `best` may be the particle.
void expect_blended(const BeaconMclParticles& before, const BeaconMclParticles& after, int i,
                    int best) {
  const double b = best == i ? 0.0 : before.weight[best] / (before.weight[i] + before.weight[best]);
  const double a = 1.0 - b;
  const auto mean = [&](const auto& column) { return a * column(i) + b * column(best); };
  const auto covariance = [&](const auto& first, const auto& second, const auto& column) {
    const double across = a * first(i) * second(i) + b * first(best) * second(best);
    return mean(column) + across - mean(first) * mean(second);
  };
  EXPECT_NEAR(after.scale(i), mean(before.scale), 1e-12);
  EXPECT_NEAR(after.bias(i), mean(before.bias), 1e-12);
  EXPECT_NEAR(after.yaw_rate_bias(i), mean(before.yaw_rate_bias), 1e-12);
  EXPECT_NEAR(after.scale_variance(i),
              covariance(before.scale, before.scale, before.scale_variance), 1e-12);
  EXPECT_NEAR(after.scale_bias_covariance(i),
              covariance(before.scale, before.bias, before.scale_bias_covariance), 1e-12);
  EXPECT_NEAR(after.bias_variance(i), covariance(before.bias, before.bias, before.bias_variance),
              1e-12);
  EXPECT_NEAR(after.yaw_rate_bias_variance(i),
              covariance(before.yaw_rate_bias, before.yaw_rate_bias, before.yaw_rate_bias_variance),
              1e-12);
  EXPECT_NEAR(std::log(after.translation_factor(i)), mean(before.translation_factor.log().eval()),
              1e-12);
}

// Kwak section 5.1 with normalised pair weights: the worst particle goes towards the best, the
// second worst towards the second best, positions linearly and headings along the shorter arc.
// Weights are reset, nobody is copied; what each has learnt is blended as its pose is.
TEST(BeaconMclRenewal, CompensationBlendsTheWeakWithTheStrong) {
  BeaconMclOptions options = plain_options();
  options.particles = 100;
  options.initialization.heading = 3.1;
  options.calibration.estimation = CalibrationEstimation::shared;
  options.yaw_rate_bias.estimate = true;
  options.noise_estimation.odometry = true;
  options.noise_estimation.odometry_walk = 0.0;
  BeaconMclOptions compensating = options;
  compensating.strategy.schedule = Schedule::always;
  compensating.strategy.compensation.covariance = CovarianceTreatment::moment_matched;
  compensating.strategy.renewal = Renewal::compensation;
  BeaconMcl carried(options, square_of_beacons(), 7);
  BeaconMcl blended(compensating, square_of_beacons(), 7);
  OdometryIncrement step;
  step.mean = {0.5, 0.0, 0.1};
  step.duration = 1.0;
  step.covariance.diagonal() << 0.01, 0.0025, 0.04;
  step.yaw_rate_sensitivity = {0.0, 0.0, step.duration};
  carried.update(step, {range_of(1, 12.5)});
  blended.update(step, {range_of(1, 12.5)});
  EXPECT_TRUE(blended.status().renewed);
  EXPECT_EQ(blended.status().renewals, 1);
  EXPECT_EQ(blended.status().distinct_ancestors_of_renewal, 100);
  EXPECT_EQ(blended.status().distinct_ancestors_since_start, 100);
  const BeaconMclParticles& before = carried.particles();
  const BeaconMclParticles& after = blended.particles();
  for (const Eigen::ArrayXd& learnt :
       {Eigen::ArrayXd(before.scale.col(0)), before.yaw_rate_bias, before.translation_factor}) {
    ASSERT_GT(learnt.maxCoeff(), learnt.minCoeff()) << "what all have learnt alike shows nothing";
  }
  std::vector<int> order(100);
  for (int i = 0; i < 100; ++i) order[static_cast<std::size_t>(i)] = i;
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return before.weight[a] < before.weight[b]; });
  for (std::size_t rank = 0; rank < 100; ++rank) {
    const int i = order[rank];
    Pose2 expected{before.x[i], before.y[i], before.heading[i]};
    if (rank < 50) {
      const int best = order[99 - rank];
      const double b = before.weight[best] / (before.weight[i] + before.weight[best]);
      expected.x += b * (before.x[best] - before.x[i]);
      expected.y += b * (before.y[best] - before.y[i]);
      expected.heading += b * std::remainder(before.heading[best] - before.heading[i], 2 * M_PI);
    }
    expect_blended(before, after, i, rank < 50 ? order[99 - rank] : i);
    EXPECT_NEAR(after.x[i], expected.x, 1e-12);
    EXPECT_NEAR(after.y[i], expected.y, 1e-12);
    EXPECT_NEAR(std::remainder(after.heading[i] - expected.heading, 2 * M_PI), 0.0, 1e-12);
    EXPECT_EQ(after.ancestor[i], i);
  }
  EXPECT_LT((after.weight - 0.01).abs().maxCoeff(), 1e-15);
  // Another count cannot be had by blending: that one time it is redrawn.
  compensating.particles = 150;
  blended.set_options(compensating);
  blended.update({}, {range_of(2, 15.0)});
  EXPECT_EQ(blended.particles().size(), 150);
  EXPECT_TRUE(all_finite(blended));
}

}  // namespace
}  // namespace pf_resampling
