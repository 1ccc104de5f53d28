// What BeaconMcl refuses, with every bit of it in place.

#include <gtest/gtest.h>

#include <limits>
#include <utility>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/filters/beacon_mcl/checks.hpp"
#include "pf_resampling_core/test/filters/beacon_mcl/filter_testing.hpp"
#include "pf_resampling_core/test/says.hpp"

namespace pf_resampling {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(BeaconMclChecks, BadRangesAreRefusedWithEveryBitInPlace) {
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

TEST(BeaconMclChecks, BadOdometryIsRefusedWithEveryBitInPlace) {
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

TEST(BeaconMclChecks, BadPosesAreRefusedWithEveryBitInPlace) {
  BeaconMcl filter = lived_in(default_options_with(100));
  const std::vector<double> before = all_numbers(filter);
  const Eigen::Matrix3d unit = Eigen::Matrix3d::Identity();
  const std::pair<Pose2, Eigen::Matrix3d> bad[] = {{{kNan, 0.0, 0.0}, unit},
                                                   {{0.0, 0.0, kNan}, unit},
                                                   {{0.0, 0.0, 0.0}, kNan * unit},
                                                   {{0.0, 0.0, 0.0}, -unit}};
  for (const auto& [mean, covariance] : bad) {
    EXPECT_THROW(filter.initialize_gaussian(mean, covariance), Error);
  }
  EXPECT_TRUE(same_bytes(all_numbers(filter), before));
}

TEST(BeaconMclChecks, AnUnknownBeaconIsToldWithThoseKnown) {
  BeaconMcl filter = lived_in(default_options_with(100));
  EXPECT_EQ(refusal([&] { filter.update({}, {range_of(17, 5.0)}); }),
            "beacon 17 is not known; known are 1, 2, 3, 4");
  EXPECT_THROW(filter.corrected_range(17, 5.0), Error);
}

TEST(BeaconMclChecks, BeaconsHaveToMakeSense) {
  const BeaconMclOptions options;
  EXPECT_THROW(BeaconMcl(options, {}, 1), Error);
  EXPECT_TRUE(says(refusal([&] {
                     BeaconMcl(options, {{3, {0, 0, 0}, true}, {4, {1, 0, 0}}, {3, {2, 0, 0}}}, 1);
                   }),
                   "beacon 3 appears twice"));
  for (const double bad : {kNan, kInfinity, 1e200}) {
    EXPECT_THROW(BeaconMcl(options, {{3, {0.0, bad, 0.0}, true}}, 1), Error) << bad;
  }
  EXPECT_THROW(BeaconMcl(options, square_of_beacons(), 1, {{1, {kNan, 0.0, 0.0}}}), Error);
  EXPECT_THROW(BeaconMcl(options, square_of_beacons(), 1, {{1, {0.0, 0.0, 0.0}}}), Error);
  EXPECT_THROW(BeaconMcl(options, square_of_beacons(), 1, {{1, {1.0, kInfinity, 0.0}}}), Error);
  EXPECT_THROW(BeaconMcl(options, square_of_beacons(), 1, {{1, {1.0, 0.0, -0.1}}}), Error);
}

TEST(BeaconMclChecks, BeforeTheFirstRangesThereIsNoEstimate) {
  BeaconMcl filter(default_options_with(100), square_of_beacons(), 1);
  EXPECT_FALSE(filter.is_initialized());
  EXPECT_THROW(filter.estimate(), Error);
  EXPECT_NO_THROW(filter.calibration());
  EXPECT_NO_THROW(filter.yaw_rate_bias());
}

}  // namespace
}  // namespace pf_resampling
