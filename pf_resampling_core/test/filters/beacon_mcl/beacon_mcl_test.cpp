// What BeaconMcl does with its population: weighs it, and comes to the same again.

#include "pf_resampling_core/filters/beacon_mcl/beacon_mcl.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "pf_resampling_core/test/filters/beacon_mcl/filter_testing.hpp"

namespace pf_resampling {
namespace {

double density(double deviation, double sigma) {
  return std::exp(-0.5 * deviation * deviation / (sigma * sigma)) / (std::sqrt(2.0 * M_PI) * sigma);
}

// --- Weights -------------------------------------------------------------------------------------

// Beacons at a height, one of unknown height, the antenna off the robot's middle: weights of a
// still robot are the product of the likelihoods.
TEST(BeaconMcl, WeightsAreTheProductOfLikelihoods) {
  BeaconMclOptions options = plain_options();
  options.ranges.outlier_share = 0.1;
  options.ranges.maximum_range = 50.0;
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
      return 0.9 * density(innovation, sigma) + 0.1 / 50.0;
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

// More than are taken in at one go.
TEST(BeaconMcl, RangesOfAMomentAreTakenInAsOneAfterTheOther) {
  BeaconMclOptions options = plain_options();
  options.ranges.outlier_share = 0.05;
  BeaconMcl together(options, square_of_beacons(), 3);
  BeaconMcl single(options, square_of_beacons(), 3);
  std::vector<RangeObservation> ranges;
  double log_likelihood = 0.0;
  for (int i = 0; i < 19; ++i) {
    ranges.push_back(range_of(1 + i % 4, 12.0 + std::sin(9.0 * i)));
    single.update({}, {ranges.back()});
    log_likelihood += single.status().log_likelihood;
  }
  together.update({}, ranges);
  EXPECT_LT((together.particles().weight - single.particles().weight).abs().maxCoeff(), 1e-12);
  EXPECT_NEAR(together.status().log_likelihood, log_likelihood, 1e-9);
  EXPECT_NEAR(together.status().innovation, single.status().innovation, 1e-9);
  EXPECT_NEAR(together.status().innovation_sigma, single.status().innovation_sigma, 1e-9);
  EXPECT_NEAR(together.status().effective_sample_size, single.status().effective_sample_size, 1e-7);
}

// Their product is a likelihood whose square vanishes.
TEST(BeaconMcl, RangesOfAMomentThatAreHardlyExplainedAreTakenInToo) {
  BeaconMcl together(plain_options(), square_of_beacons(), 3);
  BeaconMcl single(plain_options(), square_of_beacons(), 3);
  std::vector<RangeObservation> ranges;
  for (int i = 0; i < 4; ++i) {
    ranges.push_back(range_of(1 + i, 21.0, 0.2));
    single.update({}, {ranges.back()});
  }
  together.update({}, ranges);
  ASSERT_EQ(together.status().weight_resets, 0);
  ASSERT_LT(together.status().log_likelihood, -400.0);
  EXPECT_NEAR(together.status().effective_sample_size, single.status().effective_sample_size, 1e-7);
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

// --- Repeating
// -------------------------------------------------------------------------------------

TEST(BeaconMcl, SameSeedSameBytesWhateverTheNumberOfThreads) {
  // So many that everything is shared out.
  BeaconMclOptions options = default_options_with(20 * 2048 + 123);
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

}  // namespace
}  // namespace pf_resampling
