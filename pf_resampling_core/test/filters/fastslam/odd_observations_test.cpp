// What recordings hold now and then: misread ids, observations of nothing, of everything, of the
// place where the sensor is.

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "pf_resampling_core/filters/fastslam/fastslam.hpp"

namespace pf_resampling {
namespace {

RangeBearingObservation seen(double x, double y, int id) {
  return {id, std::hypot(x, y), std::atan2(y, x)};
}

FastSlamOptions some_options(int particles) {
  FastSlamOptions options;
  options.particles = particles;
  return options;
}

Eigen::Vector2d place_of(FastSlam* filter, std::int64_t id) {
  for (const LandmarkEstimate& landmark : filter->map()) {
    if (landmark.id == id) return landmark.mean;
  }
  ADD_FAILURE() << "no landmark " << id;
  return {};
}

// Id 1 is read wrongly when it is seen first. Seen once (log-odds 0.9), it is given up below -1.5:
// with the third contradiction; and then started where it is.
TEST(OddObservations, AFirstSightingThatWasMisreadIsRevised) {
  FastSlam filter(some_options(50), 1);
  filter.update({}, {seen(3.0, 0.0, 0), seen(0.5, 2.0, 1)});
  for (int scan = 1; scan <= 3; ++scan) {
    EXPECT_NEAR((place_of(&filter, 1) - Eigen::Vector2d(0.5, 2.0)).norm(), 0.0, 0.1) << scan;
    filter.update({}, {seen(3.0, 0.0, 0), seen(4.0, -3.0, 1)});
  }
  for (int scan = 0; scan < 3; ++scan) {
    filter.update({}, {seen(3.0, 0.0, 0), seen(4.0, -3.0, 1)});
  }
  EXPECT_NEAR((place_of(&filter, 1) - Eigen::Vector2d(4.0, -3.0)).norm(), 0.0, 0.1);
  EXPECT_NEAR((place_of(&filter, 0) - Eigen::Vector2d(3.0, 0.0)).norm(), 0.0, 0.1);
  EXPECT_EQ(filter.status().landmarks, 2);
  EXPECT_GE(filter.outcomes()[1].accepted, 0.99);
}

// One reading in three is wrong, each time in another way: the landmark stays where it is.
TEST(OddObservations, ALandmarkThatIsMisreadNowAndThenStays) {
  FastSlam filter(some_options(50), 1);
  for (int scan = 0; scan < 60; ++scan) {
    const bool is_misread = scan % 3 == 2;
    filter.update({},
                  {seen(3.0, 0.0, 0), is_misread ? seen(-2.0, 0.1 * scan, 1) : seen(4.0, -3.0, 1)});
    EXPECT_NEAR((place_of(&filter, 1) - Eigen::Vector2d(4.0, -3.0)).norm(), 0.0, 0.1) << scan;
  }
  EXPECT_EQ(filter.status().gated, 20);
}

// Landmark 0 is read as 1 from now on, for long: where it is seen there is a landmark, so this is
// no news of landmark 1.
TEST(OddObservations, WhatIsReadWhereAnotherLandmarkIsSaysNothing) {
  FastSlam filter(some_options(50), 1);
  for (int scan = 0; scan < 10; ++scan) {
    filter.update({}, {seen(3.0, 0.0, 0), seen(4.0, -3.0, 1), seen(1.0, 2.0, 2)});
  }
  for (int scan = 0; scan < 50; ++scan) {
    filter.update({}, {seen(3.0, 0.0, 1), seen(1.0, 2.0, 2)});
  }
  EXPECT_EQ(filter.status().gated, 50);
  EXPECT_NEAR((place_of(&filter, 1) - Eigen::Vector2d(4.0, -3.0)).norm(), 0.0, 0.1);
}

// What matches nothing has the density of a new landmark: its share of the observations, spread
// over what the sensor has seen so far, here 4 m and 0.5 rad to either side.
TEST(OddObservations, ANewLandmarkHasTheDensityOfNewOnes) {
  FastSlamOptions options = some_options(10);
  options.association.new_landmark_share = 0.1;
  FastSlam filter(options, 1);
  RangeBearingObservation z = {-1, 4.0, -0.5};
  filter.update({}, {z});
  EXPECT_NEAR(filter.status().log_likelihood, std::log(0.1 / (4.0 * 2.0 * 0.5)), 1e-9);
}

// A robot that comes back after a long way without observations is where half of the particles
// match what they see with the map and half do not. Those that do win: no landmark is doubled.
TEST(OddObservations, ComingBackFindsTheMapAgain) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    FastSlamOptions options = some_options(500);
    options.odometry_errors.estimate = false;
    FastSlam filter(options, seed);
    const std::vector<RangeBearingObservation> scan = {seen(3.0, 0.0, -1), seen(4.0, -3.0, -1),
                                                       seen(2.0, 2.5, -1)};
    for (int k = 0; k < 10; ++k) filter.update({}, scan);
    OdometryIncrement gap;
    gap.duration = 60.0;
    gap.covariance.diagonal() << 0.25, 0.25, 0.04;
    filter.update(gap, {});
    for (int k = 0; k < 40; ++k) filter.update({}, scan);
    EXPECT_EQ(filter.map().size(), 3u) << "seed " << seed;
    const Pose2 pose = filter.estimate().mean;
    EXPECT_LT(std::hypot(pose.x, pose.y), 0.4) << "seed " << seed;
  }
}

// Along a row of landmarks and half of the way back, with a sensor that sees 5 m far, now and then
// something at 60 m: what is still too far away was not missed.
TEST(OddObservations, AWildReadingTakesNoLandmarkAway) {
  FastSlam filter(some_options(30), 1);
  std::vector<Eigen::Vector2d> places;
  for (int k = 0; k < 10; ++k) places.emplace_back(2.0 * k + 1.0, k % 2 == 0 ? 1.0 : -1.5);
  Pose2 truth;
  for (int t = 0; t < 150; ++t) {
    OdometryIncrement odometry;
    odometry.duration = 0.5;
    odometry.mean = t == 100 ? Pose2{0.0, 0.0, kPi} : Pose2{0.2, 0.0, 0.0};
    odometry.covariance.diagonal() << 1e-6, 1e-6, 1e-6;
    truth = compose(truth, odometry.mean);
    std::vector<RangeBearingObservation> scan;
    for (const Eigen::Vector2d& place : places) {
      const Pose2 there = relative(truth, {place.x(), place.y(), 0.0});
      if (there.x > 0.0 && std::hypot(there.x, there.y) < 5.0) {
        scan.push_back(seen(there.x, there.y, -1));
      }
    }
    if (t % 40 == 20) scan.push_back(seen(60.0, 10.0, -1));
    filter.update(odometry, scan);
  }
  for (const Eigen::Vector2d& place : places) {
    double nearest = HUGE_VAL;
    for (const LandmarkEstimate& landmark : filter.map()) {
      nearest = std::min(nearest, (landmark.mean - place).norm());
    }
    EXPECT_LT(nearest, 0.5) << place.transpose();
  }
}

}  // namespace
}  // namespace pf_resampling
