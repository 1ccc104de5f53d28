#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>

#include "pf_resampling_core/filters/beacon_mcl/presets.hpp"
#include "pf_resampling_core/filters/fastslam/presets.hpp"
#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {
namespace {

TEST(Kwak2008, HasTheNumbersOfItsSection4) {
  const FastSlamOptions options = fastslam_options_of("kwak2008");
  EXPECT_EQ(options.particles, 100);
  EXPECT_EQ(options.strategy.threshold, 0.75);
  EXPECT_EQ(options.strategy.tempering, 1.0);
  EXPECT_EQ(options.strategy.resampling.rank_max, 1.5);
  EXPECT_EQ(options.sensor.range_sigma, 0.1);
  EXPECT_NEAR(options.sensor.bearing_sigma, kPi / 180.0, 1e-8);
  // White noise of 0.3 m/s and 3 degrees/s, drawn anew every 25 ms, over one second: the sum of 40
  // independent steps of 0.3 * 0.025 m.
  EXPECT_NEAR(options.odometry.along_per_time, 0.3 * 0.025 * std::sqrt(40.0), 1e-8);
  EXPECT_NEAR(options.odometry.heading_per_time, 3.0 * kPi / 180.0 * 0.025 * std::sqrt(40.0), 1e-8);
  EXPECT_EQ(options.strategy.excitation.method, Excitation::none);
}

// What the preset leaves out would follow the defaults, which may change. A parameter that is new
// has to be written there, with what makes it do nothing, unless known ids leave it without a use.
TEST(Kwak2008, SaysWhatEveryParameterIsThatConcernsIt) {
  const std::map<std::string, std::string>& values =
      preset_named(fastslam_presets(), "kwak2008").values;
  FastSlamOptions options;
  for (const Parameter& parameter : parameters_of(&options)) {
    const std::string& name = parameter.name;
    const std::string group = name.substr(0, name.find('/'));
    const bool concerns_it = group == "version" || group == "population" || group == "odometry" ||
                             group == "sensor" || group == "association" ||
                             name == "excitation/method" || name == "odometry_errors/estimate";
    const bool is_without_use = name == "population/every_n" || name == "sensor/maximum_range" ||
                                name == "sensor/field_of_view" ||
                                name == "population/resampling/library" ||
                                name.find("population/redraw/") == 0 ||  // it has none
                                name.find("log_odds") != std::string::npos;
    if (!concerns_it || is_without_use) continue;
    EXPECT_EQ(values.count(name), 1u)
        << "the preset kwak2008 does not say what " << name << " is in the filter of the paper";
  }
}

// Mahmoud (2012), section III: it moves, weighs, resamples, and knows of nothing else.
TEST(Mahmoud2012, InheritsNothingThatThePaperDoesNotHave) {
  const BeaconMclOptions options = beacon_mcl_options_of("mahmoud2012");
  EXPECT_EQ(options.strategy.schedule, Schedule::always);
  EXPECT_EQ(options.strategy.renewal, Renewal::resampling);
  EXPECT_EQ(options.strategy.tempering, 1.0);
  EXPECT_EQ(options.strategy.excitation.method, Excitation::none);
  EXPECT_EQ(options.strategy.excitation.bandwidth_scale, 1.0);
  EXPECT_EQ(options.ranges.outlier_share, 0.0);
  EXPECT_EQ(options.calibration.estimation, CalibrationEstimation::off);
  EXPECT_EQ(options.initialization.method, Initialization::uniform);
  EXPECT_FALSE(options.recovery.enabled);
  EXPECT_FALSE(options.yaw_rate_bias.estimate);
  EXPECT_FALSE(options.noise_estimation.ranges);
  EXPECT_FALSE(options.noise_estimation.odometry);
}

}  // namespace
}  // namespace pf_resampling
