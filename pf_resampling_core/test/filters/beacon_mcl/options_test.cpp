// What of BeaconMcl changes with its options while it runs, and which options it refuses.

#include "pf_resampling_core/filters/beacon_mcl/options.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/filters/beacon_mcl/filter_testing.hpp"
#include "pf_resampling_core/test/says.hpp"

namespace pf_resampling {
namespace {

TEST(BeaconMclOptions, OtherStrategiesLeaveParticlesAndWeightsAsTheyAre) {
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
    for (const Renewal renewal : all_values<Renewal>()) {
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
    options.yaw_rate_bias.walk = 1e-3;
    options.ranges.sigma = 3.0;
    options.odometry.slip_per_distance = 0.5;
    expect_unchanged("models");
  }
}

// Another layout of the calibration starts that anew; poses and weights stay.
TEST(BeaconMclOptions, OtherCalibrationKeepsPosesAndWeights) {
  BeaconMclOptions options = default_options_with(250);
  BeaconMcl filter = lived_in(options);
  const BeaconMclParticles before = filter.particles();
  for (const CalibrationEstimation estimation :
       {CalibrationEstimation::off, CalibrationEstimation::shared}) {
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

TEST(BeaconMclOptions, AnotherParticleCountComesWithTheNextUpdate) {
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

TEST(BeaconMclOptions, ImpossibleOptionsChangeNothing) {
  BeaconMclOptions options = default_options_with(250);
  BeaconMcl filter = lived_in(options);
  const std::vector<double> before = all_numbers(filter);
  const auto expect_refused = [&](const BeaconMclOptions& bad, const std::string& part) {
    EXPECT_TRUE(says(refusal([&] { filter.set_options(bad); }), part));
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
}

// What is switched off afterwards is not estimated any more, what is switched on is.
TEST(BeaconMclOptions, YawRateBiasIsSwitchedOnAndOff) {
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

TEST(BeaconMclOptions, BeaconsAreFoundByTheMemoryOfRedraws) {
  BeaconMclOptions options;
  options.beacon_positions = BeaconPositions::estimated;
  EXPECT_THROW(validate(options), Error);
  EXPECT_THROW(BeaconMcl(options, {}, 1), Error);
  options.strategy.renewal = Renewal::redraw;
  EXPECT_EQ(BeaconMcl(options, {}, 1).found_beacons().size(), 0U);
}

}  // namespace
}  // namespace pf_resampling
