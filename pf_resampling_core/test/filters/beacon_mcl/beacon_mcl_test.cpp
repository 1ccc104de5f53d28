// What BeaconMcl does with its population: weighs, keeps, changes, refuses.

#include "pf_resampling_core/filters/beacon_mcl/beacon_mcl.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <set>
#include <string>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/filters/beacon_mcl/filter_testing.hpp"

namespace pf_resampling {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

double normal_density(double deviation, double sigma) {
  return std::exp(-0.5 * deviation * deviation / (sigma * sigma)) / (std::sqrt(2.0 * M_PI) * sigma);
}

// A filter that has drawn, learnt and renewed for a while, with everything switched on.
BeaconMcl lived_in(const BeaconMclOptions& options, int updates = 30, std::uint64_t seed = 5) {
  BeaconMcl filter(options, square_of_beacons(), seed);
  const Pose2 step{0.1, 0.0, 0.02};
  Pose2 truth{8.0, 9.0, 0.3};
  for (int i = 0; i < updates; ++i) {
    truth = compose(truth, step);
    const Beacon beacon = filter.beacons()[static_cast<std::size_t>(i % 4)];
    const double distance =
        std::hypot(beacon.position.x() - truth.x, beacon.position.y() - truth.y);
    filter.update(step_of(options.odometry, step, 0.1),
                  {range_of(beacon.id, 1.05 * distance + 0.1 + 0.3 * std::sin(9.0 * i))});
  }
  return filter;
}

BeaconMclOptions default_options_with(int particles) {
  BeaconMclOptions options;
  options.particles = particles;
  return options;
}

// --- Weights -------------------------------------------------------------------------------------

// Beacons at a height, one of unknown height, the antenna off the robot's middle: weights of a
// still robot are the product of the likelihoods.
TEST(BeaconMcl, WeightsAreTheProductOfLikelihoods) {
  BeaconMclOptions options = plain_options();
  options.ranges.outlier_share = 0.1;
  options.ranges.maximum_range = 50.0;
  options.ranges.non_line_of_sight_share = 0.2;
  options.ranges.non_line_of_sight_mean = 1.5;
  options.ranges.sigma = 0.8;
  const std::vector<Beacon> beacons = {{7, {0.0, 0.0, 4.0}, false}, {8, {20.0, 5.0, 0.0}, true}};
  BeaconMcl filter(options, beacons, 3, {{-1, {1.1, 0.3, 0.0}}, {8, {0.9, -0.2, 1.2}}});
  const BeaconMclParticles start = filter.particles();
  const Eigen::Vector3d antenna(0.5, -0.2, 1.0);
  filter.update({}, {range_of(7, 14.0, 0.0, antenna), range_of(7, 17.0, 0.25, antenna)});
  filter.update({}, {range_of(8, 11.0, 0.25, antenna)});

  Eigen::ArrayXd expected(start.size());
  double last = 0.0;
  for (Eigen::Index i = 0; i < start.size(); ++i) {
    const Pose2 at = compose({start.x[i], start.y[i], start.heading[i]}, {0.5, -0.2, 0.0});
    const auto likelihood = [&](double innovation, double sigma) {
      return 0.7 * normal_density(innovation, sigma) + 0.1 / 50.0 +
             (innovation > 0.0 ? 0.2 / 1.5 * std::exp(-innovation / 1.5) : 0.0);
    };
    const double high = std::sqrt(at.x * at.x + at.y * at.y + 9.0);
    const double level = std::hypot(20.0 - at.x, 5.0 - at.y);
    // Noise: the calibration's before the message's before the model's.
    last = likelihood(11.0 - (0.9 * level - 0.2), 1.2);
    expected[i] = likelihood(14.0 - (1.1 * high + 0.3), 0.8) *
                  likelihood(17.0 - (1.1 * high + 0.3), 0.5) * last;
  }
  expected /= expected.sum();
  EXPECT_LT((filter.particles().weight - expected).abs().maxCoeff(), 1e-12);
  EXPECT_LT((filter.particles().log_weight - expected.log()).abs().maxCoeff(), 1e-9);
  EXPECT_NEAR(filter.status().effective_sample_size, 1.0 / expected.square().sum(), 1e-8);
  EXPECT_NEAR(filter.status().entropy_sample_size, std::exp(-(expected * expected.log()).sum()),
              1e-8);
  EXPECT_TRUE((filter.particles().x == start.x).all());
  EXPECT_EQ(filter.status().observation, 8);
  EXPECT_EQ(filter.status().updates, 2);
}

// From equal weights, tempering by 0.3 gives the power 0.3 of the weights; the likelihood that is
// stated is that of the whole range.
TEST(BeaconMcl, TemperingTakesUpAShareOfTheLikelihood) {
  BeaconMclOptions options = plain_options();
  BeaconMcl whole(options, square_of_beacons(), 3);
  options.strategy.tempering = 0.3;
  BeaconMcl tempered(options, square_of_beacons(), 3);
  for (BeaconMcl* filter : {&whole, &tempered}) filter->update({}, {range_of(3, 14.0)});
  const Eigen::ArrayXd power = whole.particles().weight.pow(0.3);
  EXPECT_LT((tempered.particles().weight - power / power.sum()).abs().maxCoeff(), 1e-12);
  EXPECT_NEAR(tempered.status().log_likelihood, whole.status().log_likelihood, 1e-9);
}

// One place, so that the likelihood of the filter is that of the place.
TEST(BeaconMcl, DetoursAreLikelyOnOneSideOnly) {
  BeaconMclOptions options = known_pose_options();
  options.ranges.outlier_share = 0.05;
  options.ranges.maximum_range = 100.0;
  options.ranges.non_line_of_sight_share = 0.3;
  options.ranges.non_line_of_sight_mean = 2.0;
  options.ranges.sigma = 0.5;
  const double distance = std::hypot(8.0, 9.0);
  const auto log_likelihood = [&](double excess) {
    BeaconMcl filter(options, square_of_beacons(), 1);
    filter.update({}, {range_of(1, distance + excess)});
    return filter.status().log_likelihood;
  };
  const double floor = 0.05 / 100.0;
  EXPECT_NEAR(log_likelihood(6.0), std::log(0.3 / 2.0 * std::exp(-3.0) + floor), 1e-9);
  EXPECT_NEAR(log_likelihood(-6.0), std::log(floor), 1e-9);
  EXPECT_NEAR(log_likelihood(0.0), std::log(0.65 * normal_density(0.0, 0.5) + floor), 1e-9);
  EXPECT_NEAR(log_likelihood(-0.5), std::log(0.65 * normal_density(-0.5, 0.5) + floor), 1e-9);
}

TEST(BeaconMcl, OneWildRangeMovesNothing) {
  BeaconMclOptions options = plain_options();
  options.particles = 5000;
  options.ranges.outlier_share = 0.05;
  for (const double wild : {120.0, 0.01}) {
    BeaconMcl filter(options, square_of_beacons(), 7);
    for (const int beacon : {1, 2, 3, 4}) {
      const Eigen::Vector3d place =
          square_of_beacons()[static_cast<std::size_t>(beacon - 1)].position;
      filter.update({}, {range_of(beacon, std::hypot(place.x() - 8.0, place.y() - 9.0), 0.01)});
    }
    const PoseEstimate before = filter.estimate();
    filter.update({}, {range_of(1, wild, 0.01)});
    const PoseEstimate after = filter.estimate();
    // All places the range could be of are 90 deviations away: only the floor is left.
    EXPECT_NEAR(after.mean.x, before.mean.x, 1e-9);
    EXPECT_NEAR(after.mean.y, before.mean.y, 1e-9);
    EXPECT_LT((after.covariance - before.covariance).norm(), 1e-9);
  }
}

// Without an outlier floor a range that no particle can explain leaves no weight at all: said, not
// passed over.
TEST(BeaconMcl, WhenAllWeightsVanishTheyAreResetAndCounted) {
  for (const CalibrationEstimation estimation : all_values<CalibrationEstimation>()) {
    BeaconMclOptions options = plain_options();
    options.calibration.estimation = estimation;
    BeaconMcl filter(options, square_of_beacons(), 7);
    filter.update({}, {range_of(1, 13.0)});
    ASSERT_EQ(filter.status().weight_resets, 0);
    ASSERT_LT(filter.status().effective_sample_size, 499.0);
    filter.update({}, {range_of(1, 1e6)});
    EXPECT_EQ(filter.status().weight_resets, 1) << to_string(estimation);
    EXPECT_TRUE((filter.particles().weight == 1.0 / 500.0).all()) << to_string(estimation);
    EXPECT_TRUE(all_finite(filter));
    filter.update({}, {range_of(1, 13.0)});
    EXPECT_EQ(filter.status().weight_resets, 1);
    EXPECT_TRUE(all_finite(filter));
  }
}

TEST(BeaconMcl, NothingNonFiniteComesOfAbsurdRanges) {
  for (const bool learns : {false, true}) {
    for (const double outlier_share : {0.0, 0.05}) {
      BeaconMclOptions options = learns ? default_options_with(200) : plain_options();
      options.initialization.method = Initialization::uniform;
      options.ranges.outlier_share = outlier_share;
      BeaconMcl filter(options, square_of_beacons(), 7);
      for (const double absurd : {1e-300, 1e-9, 1e3, 1e6, 1e12}) {
        for (int i = 0; i < 5; ++i) {
          filter.update(step_of(OdometryNoise{}, {0.1, 0.0, 0.0}, 0.1),
                        {range_of(1, absurd), range_of(2, absurd, 1e-6), range_of(3, absurd, 1e6)});
        }
        ASSERT_TRUE(all_finite(filter)) << absurd;
        for (const CalibrationEstimate& estimate : filter.calibration()) {
          EXPECT_TRUE(std::isfinite(estimate.scale_sigma) && std::isfinite(estimate.bias_sigma));
        }
      }
    }
  }
}

// --- Carrying weights on -------------------------------------------------------------------------

TEST(BeaconMcl, WithoutRenewalTheWeightsAreCarriedOn) {
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

TEST(BeaconMcl, SchedulesCountTheirRenewals) {
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
TEST(BeaconMcl, WeightsAfterRenewalAreCarriedOn) {
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
TEST(BeaconMcl, CountsAncestorsOfTheLastRenewalAndSinceTheStart) {
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
TEST(BeaconMcl, TheScheduleGoesByTheEffectiveSampleSize) {
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
TEST(BeaconMcl, CompensationBlendsTheWeakWithTheStrong) {
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

// --- Other options -------------------------------------------------------------------------------

// It has no map whose past could be solved for.
TEST(BeaconMcl, RefusesToRedraw) {
  BeaconMclOptions options;
  options.strategy.renewal = Renewal::redraw;
  try {
    validate(options);
    FAIL() << "took it";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("population/renewal"), std::string::npos)
        << error.what();
  }
}

TEST(BeaconMcl, OtherStrategiesLeaveParticlesAndWeightsAsTheyAre) {
  for (const int updates : {0, 3, 25}) {
    BeaconMclOptions options = default_options_with(250);
    BeaconMcl filter = lived_in(options, updates);
    const std::vector<double> before = all_numbers(filter);
    const auto expect_unchanged = [&](const std::string& what) {
      filter.set_options(options);
      EXPECT_TRUE(same_bytes(all_numbers(filter), before)) << what << " after " << updates;
    };
    for (const ResamplingScheme scheme : all_values<ResamplingScheme>()) {
      options.strategy.resampling.scheme = scheme;
      expect_unchanged(to_string(scheme));
    }
    for (const Schedule schedule : all_values<Schedule>()) {
      options.strategy.schedule = schedule;
      expect_unchanged(to_string(schedule));
    }
    for (const Renewal renewal : renewals_without_redraw()) {
      options.strategy.renewal = renewal;
      expect_unchanged(to_string(renewal));
    }
    for (const Excitation excitation : all_values<Excitation>()) {
      options.strategy.excitation.method = excitation;
      expect_unchanged(to_string(excitation));
    }
    options.particles = 777;
    expect_unchanged("another particle count");
    options.threads = 2;
    expect_unchanged("another thread count");
    options.recovery.enabled = false;
    options.adaptive_count.enabled = true;
    options.yaw_rate_bias.walk = 1e-3;
    options.ranges.sigma = 3.0;
    options.odometry.slip_per_distance = 0.5;
    expect_unchanged("models");
  }
}

// Another layout of the calibration starts that anew; poses and weights stay.
TEST(BeaconMcl, OtherCalibrationKeepsPosesAndWeights) {
  BeaconMclOptions options = default_options_with(250);
  BeaconMcl filter = lived_in(options);
  const BeaconMclParticles before = filter.particles();
  for (const CalibrationEstimation estimation :
       {CalibrationEstimation::per_beacon, CalibrationEstimation::off,
        CalibrationEstimation::shared}) {
    options.calibration.estimation = estimation;
    filter.set_options(options);
    EXPECT_TRUE((filter.particles().x == before.x).all());
    EXPECT_TRUE((filter.particles().heading == before.heading).all());
    EXPECT_TRUE((filter.particles().weight == before.weight).all());
    filter.calibration();
    filter.update({}, {range_of(2, 15.0)});
    EXPECT_TRUE(all_finite(filter));
    filter = lived_in(default_options_with(250));
    options = default_options_with(250);
  }
}

TEST(BeaconMcl, AnotherParticleCountComesWithTheNextUpdate) {
  for (const ResamplingScheme scheme : all_values<ResamplingScheme>()) {
    for (const int count : {400, 100}) {
      BeaconMclOptions options = default_options_with(250);
      BeaconMcl filter = lived_in(options);
      options.particles = count;
      options.strategy.resampling.scheme = scheme;
      filter.set_options(options);
      EXPECT_EQ(filter.particles().size(), 250);
      const PoseEstimate before = filter.estimate();
      filter.update(step_of(options.odometry, {}, 0.1), {});
      EXPECT_EQ(filter.particles().size(), 250) << "without a range there is no renewal";
      filter.update(step_of(options.odometry, {}, 0.1), {range_of(1, 15.0)});
      SCOPED_TRACE(to_string(scheme) + " to " + std::to_string(count));
      EXPECT_EQ(filter.particles().size(), count);
      EXPECT_EQ(filter.status().particles, count);
      EXPECT_EQ(filter.particles().scale.rows(), count);
      EXPECT_NEAR(filter.particles().weight.sum(), 1.0, 1e-9);
      EXPECT_TRUE(all_finite(filter));
      // The belief is redrawn, not rebuilt: it stays where it was.
      EXPECT_NEAR(filter.estimate().mean.x, before.mean.x, 1.0);
      EXPECT_NEAR(filter.estimate().mean.y, before.mean.y, 1.0);
    }
  }
}

TEST(BeaconMcl, ImpossibleOptionsChangeNothing) {
  BeaconMclOptions options = default_options_with(250);
  BeaconMcl filter = lived_in(options);
  const std::vector<double> before = all_numbers(filter);
  const auto expect_refused = [&](const BeaconMclOptions& bad, const std::string& part) {
    try {
      filter.set_options(bad);
      ADD_FAILURE() << "taken: " << part;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
    EXPECT_THROW(BeaconMcl(bad, square_of_beacons(), 1), Error);
    EXPECT_TRUE(same_bytes(all_numbers(filter), before)) << part;
    EXPECT_EQ(filter.options().particles, 250);
    EXPECT_EQ(filter.options().ranges.sigma, 1.0);
  };
  BeaconMclOptions bad = options;
  bad.particles = 0;
  expect_refused(bad, "particles");
  bad = options;
  bad.threads = 0;
  expect_refused(bad, "threads");
  bad = options;
  bad.ranges.sigma = 0.0;
  bad.particles = 10;
  expect_refused(bad, "ranges/sigma");
  bad = options;
  bad.strategy.threshold = 0.0;
  expect_refused(bad, "population/threshold");
  bad = options;
  bad.adaptive_count.minimum = 10000;
  expect_refused(bad, "adaptive_count/minimum");
}

// The count that was adapted is not what the user asked for: switching the adaption off goes back.
TEST(BeaconMcl, SwitchingTheAdaptiveCountOffGoesBackToTheGivenCount) {
  BeaconMclOptions options = default_options_with(600);
  options.adaptive_count.enabled = true;
  options.adaptive_count.minimum = 50;
  options.strategy.schedule = Schedule::always;
  BeaconMcl filter = lived_in(options, 40);
  ASSERT_NE(filter.particles().size(), 600);
  options.adaptive_count.enabled = false;
  filter.set_options(options);
  filter.update({}, {range_of(1, 14.0)});
  EXPECT_EQ(filter.particles().size(), 600);
}

// What is switched off afterwards is not estimated any more, what is switched on is.
TEST(BeaconMcl, YawRateBiasIsSwitchedOnAndOff) {
  BeaconMclOptions options = default_options_with(250);
  BeaconMcl filter = lived_in(options);
  ASSERT_GT(filter.yaw_rate_bias().sigma, 0.0);
  options.yaw_rate_bias.estimate = false;
  filter.set_options(options);
  filter.update(step_of(options.odometry, {0.1, 0, 0}, 0.1), {range_of(1, 14.0)});
  EXPECT_EQ(filter.yaw_rate_bias().mean, 0.0);
  EXPECT_EQ(filter.yaw_rate_bias().sigma, 0.0);
  options.yaw_rate_bias.estimate = true;
  filter.set_options(options);
  filter.update(step_of(options.odometry, {0.1, 0, 0}, 0.1), {range_of(1, 14.0)});
  EXPECT_NEAR(filter.yaw_rate_bias().sigma, options.yaw_rate_bias.sigma, 0.002);
}

// --- Bad input -----------------------------------------------------------------------------------

TEST(BeaconMcl, BadRangesAreRefusedWithEveryBitInPlace) {
  const Eigen::Vector3d nowhere(0.0, kNan, 0.0);
  const RangeObservation bad[] = {range_of(1, kNan),
                                  range_of(1, kInfinity),
                                  range_of(1, -kInfinity),
                                  range_of(1, 0.0),
                                  range_of(1, -3.0),
                                  range_of(1, 1e160),
                                  range_of(1, 5.0, -1.0),
                                  range_of(1, 5.0, kNan),
                                  range_of(1, 5.0, kInfinity),
                                  range_of(1, 5.0, 1e-320),
                                  range_of(1, 5.0, 1e300),
                                  range_of(1, 5.0, 0.0, nowhere),
                                  range_of(1, 5.0, 0.0, {1e200, 0.0, 0.0}),
                                  range_of(99, 5.0)};
  const BeaconMclOptions options = default_options_with(200);
  for (const int updates : {0, 1, 20}) {
    BeaconMcl filter = lived_in(options, updates);
    BeaconMcl untroubled = lived_in(options, updates);
    const std::vector<double> before = all_numbers(filter);
    const OdometryIncrement step = step_of(options.odometry, {0.1, 0.0, 0.0}, 0.1);
    for (const RangeObservation& range : bad) {
      SCOPED_TRACE(testing::Message() << "range " << range.range << " variance " << range.variance
                                      << " beacon " << range.beacon << " after " << updates);
      EXPECT_THROW(filter.update(step, {range}), Error);
      EXPECT_THROW(filter.update(step, {range_of(2, 15.0), range}), Error);
      EXPECT_TRUE(same_bytes(all_numbers(filter), before));
    }
    // Nor has anything changed that shows later only.
    for (int i = 0; i < 5; ++i) {
      filter.update(step, {range_of(1 + i % 4, 15.0)});
      untroubled.update(step, {range_of(1 + i % 4, 15.0)});
    }
    EXPECT_TRUE(same_bytes(all_numbers(filter), all_numbers(untroubled))) << updates;
  }
}

TEST(BeaconMcl, BadOdometryIsRefusedWithEveryBitInPlace) {
  const BeaconMclOptions options = default_options_with(200);
  BeaconMcl filter = lived_in(options);
  const std::vector<double> before = all_numbers(filter);
  for (int kind = 0; kind < 5; ++kind) {
    OdometryIncrement step = step_of(options.odometry, {0.1, 0.0, 0.0}, 0.1);
    if (kind == 0) step.mean.x = kNan;
    if (kind == 1) step.mean.heading = kInfinity;
    if (kind == 2) step.covariance(1, 1) = kNan;
    if (kind == 3) step.duration = kNan;
    if (kind == 4) step.yaw_rate_sensitivity[2] = kInfinity;
    EXPECT_THROW(filter.update(step, {range_of(1, 14.0)}), Error) << kind;
    EXPECT_THROW(filter.update(step, {}), Error) << kind;
    EXPECT_TRUE(same_bytes(all_numbers(filter), before)) << kind;
  }
}

TEST(BeaconMcl, AnUnknownBeaconIsToldWithThoseKnown) {
  BeaconMcl filter = lived_in(default_options_with(100));
  try {
    filter.update({}, {range_of(17, 5.0)});
    ADD_FAILURE();
  } catch (const Error& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("17"), std::string::npos) << text;
    EXPECT_NE(text.find("1, 2, 3, 4"), std::string::npos) << text;
  }
  EXPECT_THROW(filter.corrected_range(17, 5.0), Error);
}

TEST(BeaconMcl, BeaconsHaveToMakeSense) {
  const BeaconMclOptions options;
  EXPECT_THROW(BeaconMcl(options, {}, 1), Error);
  try {
    BeaconMcl filter(options, {{3, {0, 0, 0}, true}, {4, {1, 0, 0}, true}, {3, {2, 0, 0}, true}},
                     1);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("beacon 3"), std::string::npos) << error.what();
  }
  for (const double bad : {kNan, kInfinity, 1e200}) {
    EXPECT_THROW(BeaconMcl(options, {{3, {0.0, bad, 0.0}, true}}, 1), Error) << bad;
  }
  EXPECT_THROW(BeaconMcl(options, square_of_beacons(), 1, {{1, {kNan, 0.0, 0.0}}}), Error);
  EXPECT_THROW(BeaconMcl(options, square_of_beacons(), 1, {{1, {0.0, 0.0, 0.0}}}), Error);
  EXPECT_THROW(BeaconMcl(options, square_of_beacons(), 1, {{1, {1.0, kInfinity, 0.0}}}), Error);
  EXPECT_THROW(BeaconMcl(options, square_of_beacons(), 1, {{1, {1.0, 0.0, -0.1}}}), Error);
}

TEST(BeaconMcl, BeforeTheFirstRangesThereIsNoEstimate) {
  BeaconMcl filter(default_options_with(100), square_of_beacons(), 1);
  EXPECT_FALSE(filter.is_initialized());
  EXPECT_THROW(filter.estimate(), Error);
  EXPECT_NO_THROW(filter.calibration());
  EXPECT_NO_THROW(filter.yaw_rate_bias());
  EXPECT_NO_THROW(filter.noise_factors());
}

// --- Repeating -----------------------------------------------------------------------------------

TEST(BeaconMcl, SameSeedSameBytesWhateverTheNumberOfThreads) {
  BeaconMclOptions options = default_options_with(3 * 2048 + 123);
  const std::vector<double> expected = all_numbers(lived_in(options, 25, 9));
  EXPECT_TRUE(same_bytes(all_numbers(lived_in(options, 25, 9)), expected)) << "twice in a row";
  for (const int threads : {2, 3}) {
    options.threads = threads;
    EXPECT_TRUE(same_bytes(all_numbers(lived_in(options, 25, 9)), expected)) << threads;
  }
  EXPECT_FALSE(same_bytes(all_numbers(lived_in(options, 25, 10)), expected)) << "another seed";
}

TEST(BeaconMcl, AfterResetAllIsAsAfterConstruction) {
  for (const Initialization method : all_values<Initialization>()) {
    BeaconMclOptions options = default_options_with(300);
    options.initialization.method = method;
    BeaconMcl fresh(options, square_of_beacons(), 4);
    BeaconMcl used = lived_in(options, 30, 4);
    used.reset();
    EXPECT_TRUE(same_bytes(all_numbers(used), all_numbers(fresh))) << to_string(method);
    EXPECT_EQ(used.is_initialized(), fresh.is_initialized());
    const OdometryIncrement step = step_of(options.odometry, {0.1, 0.0, 0.01}, 0.1);
    for (int i = 0; i < 10; ++i) {
      fresh.update(step, {range_of(1 + i % 4, 14.0)});
      used.update(step, {range_of(1 + i % 4, 14.0)});
    }
    EXPECT_TRUE(same_bytes(all_numbers(used), all_numbers(fresh))) << to_string(method);
  }
}

// --- Particle count ------------------------------------------------------------------------------

// Fox (2003), eq. 7, with k bins occupied: n = (k-1)/(2 e) (1 - 2/(9(k-1)) + sqrt(2/(9(k-1))) z)^3.
// The bins are counted here, from the particles that the filter had.
TEST(BeaconMcl, AdaptiveCountIsFoxsFormula) {
  BeaconMclOptions options = default_options_with(3000);
  options.strategy.schedule = Schedule::always;
  options.initialization.method = Initialization::uniform;
  AdaptiveCountOptions& adaptive = options.adaptive_count;
  adaptive.enabled = true;
  adaptive.minimum = 50;
  adaptive.maximum = 4000;
  adaptive.error = 0.05;
  adaptive.quantile = 2.326;
  adaptive.bin_position = 0.7;
  adaptive.bin_heading = 0.2;
  BeaconMcl filter(options, square_of_beacons(), 8);
  Eigen::Index largest = 0;
  Eigen::Index smallest = 10000;
  double wanted = 3000.0;
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3d beacon = square_of_beacons()[static_cast<std::size_t>(i % 4)].position;
    filter.update(step_of(options.odometry, {}, 0.1),
                  {range_of(1 + i % 4, std::hypot(beacon.x() - 8.0, beacon.y() - 9.0), 0.04)});
    const BeaconMclParticles& p = filter.particles();
    ASSERT_EQ(static_cast<double>(p.size()), wanted) << "update " << i;
    std::set<std::array<double, 3>> bins;
    for (Eigen::Index j = 0; j < p.size(); ++j) {
      bins.insert(
          {std::floor(p.x[j] / 0.7), std::floor(p.y[j] / 0.7), std::floor(p.heading[j] / 0.2)});
    }
    const double k1 = static_cast<double>(bins.size()) - 1.0;
    const double root = 1.0 - 2.0 / (9.0 * k1) + std::sqrt(2.0 / (9.0 * k1)) * 2.326;
    wanted = k1 > 0.0 ? std::ceil(k1 / 0.1 * root * root * root) : 50.0;
    wanted = std::min(4000.0, std::max(50.0, wanted));
    largest = std::max(largest, p.size());
    smallest = std::min(smallest, p.size());
  }
  EXPECT_EQ(largest, 4000);
  EXPECT_LT(smallest, 3000);
}

// One bin holds everything: as few as allowed.
TEST(BeaconMcl, AdaptiveCountOfOneBinIsTheMinimum) {
  BeaconMclOptions options = known_pose_options();
  options.particles = 500;
  options.strategy.schedule = Schedule::always;
  options.adaptive_count.enabled = true;
  options.adaptive_count.minimum = 17;
  BeaconMcl filter(options, square_of_beacons(), 8);
  for (int i = 0; i < 2; ++i) filter.update({}, {range_of(1, 12.0)});
  EXPECT_EQ(filter.particles().size(), 17);
}

}  // namespace
}  // namespace pf_resampling
