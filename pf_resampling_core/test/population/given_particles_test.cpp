#include "pf_resampling_core/population/given_particles.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/filters/beacon_mcl/beacon_mcl.hpp"
#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "pf_resampling_core/test/says.hpp"

namespace pf_resampling {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

const std::vector<Beacon> kBeacons = {{1, {0.0, 0.0, 0.0}, true}, {2, {20.0, 0.0, 0.0}, true}};

GivenParticles three() {
  return {{{1.0, 2.0, 0.5}, {3.0, -4.0, -3.0}, {5.0, 6.0, 0.0}}, {1.0, 0.0, 3.0}};
}

std::string refusal(const GivenParticles& particles) {
  return pf_resampling::refusal([&] { check_given_particles(particles); });
}

TEST(GivenParticles, WhatIsNoPopulationIsRefusedInOneLine) {
  EXPECT_EQ(refusal(three()), "");
  const auto changed = [](const std::function<void(GivenParticles*)>& change) {
    GivenParticles particles = three();
    change(&particles);
    return refusal(particles);
  };
  const std::pair<std::string, std::string> cases[] = {
      {changed([](auto* p) { p->poses.clear(); }), "there are 0 particles; give"},
      {changed([](auto* p) { p->poses.resize(1000001); }), "there are 1000001 particles; give"},
      {changed([](auto* p) { p->poses[1].x = kNan; }), "particle 1 is at (nan m, -4 m, -3 rad)"},
      {changed([](auto* p) { p->poses[2].y = kInfinity; }), "particle 2 is at (5 m, inf m"},
      {changed([](auto* p) { p->poses[0].x = 2e9; }), "particle 0 is at (2e+09 m"},
      {changed([](auto* p) { p->poses[0].heading = kNan; }), "particle 0 is at (1 m, 2 m, nan"},
      {changed([](auto* p) { p->weights.pop_back(); }), "there are 2 weights for 3 particles"},
      {changed([](auto* p) { p->weights[2] = kNan; }), "the weight of particle 2 is nan"},
      {changed([](auto* p) { p->weights[0] = -1e-9; }), "the weight of particle 0 is -1e-09"},
      {changed([](auto* p) { p->weights[0] = kInfinity; }), "the weight of particle 0 is inf"},
      {changed([](auto* p) { p->weights.assign(3, 0.0); }), "all weights are 0; give"},
  };
  for (const auto& [said, expected] : cases) {
    EXPECT_EQ(said.rfind(expected, 0), 0u) << said << " instead of " << expected;
    EXPECT_TRUE(says(said, "; give "));
    EXPECT_FALSE(says(said, "\n"));
  }
  EXPECT_EQ(changed([](auto* p) { p->weights.clear(); }), "");
}

TEST(GivenParticles, WeightsOfAnyScaleAreTaken) {
  for (const double scale : {1e-300, 1.0, 1.7e308}) {
    GivenParticles particles = three();
    for (double& weight : particles.weights) weight *= scale / 3.0;
    const Eigen::ArrayXd logs = log_weights_of(particles);
    EXPECT_NEAR(logs[0], std::log(1.0 / 3.0), 1e-12);
    EXPECT_EQ(logs[1], -kInfinity);
    EXPECT_EQ(logs[2], 0.0);
  }
}

// Poses and weights are those that were given; then the filter goes on with as many as it is to
// have, all of them copies of particles with weight. Both filters alike.
template <typename Filter>
void expect_given(const Filter& filter) {
  const auto& particles = filter.particles();
  ASSERT_EQ(particles.size(), 3);
  EXPECT_EQ(particles.x[0], 1.0);
  EXPECT_EQ(particles.y[1], -4.0);
  EXPECT_EQ(particles.heading[1], -3.0);
  EXPECT_NEAR(particles.weight[0], 0.25, 1e-15);
  EXPECT_EQ(particles.weight[1], 0.0);
  EXPECT_NEAR(particles.weight[2], 0.75, 1e-15);
  EXPECT_NEAR(filter.estimate().mean.x, 0.25 * 1.0 + 0.75 * 5.0, 1e-12);
  EXPECT_NEAR(filter.status().effective_sample_size, 1.0 / (0.0625 + 0.5625), 1e-12);
}

TEST(GivenParticles, BeaconMclTakesThemAndGoesOnWithItsOwnNumber) {
  BeaconMclOptions options;
  options.particles = 200;
  options.strategy.excitation.method = Excitation::none;
  for (const bool has_started : {false, true}) {
    BeaconMcl filter(options, kBeacons, 1);
    if (has_started) filter.initialize_gaussian({100.0, 100.0, 0.0}, Eigen::Matrix3d::Identity());
    EXPECT_EQ(filter.is_initialized(), has_started);
    GivenParticles wrong = three();
    wrong.weights[0] = kNan;
    EXPECT_THROW(filter.set_particles(wrong), Error);
    EXPECT_EQ(filter.is_initialized(), has_started);
    filter.set_particles(three());
    expect_given(filter);
    // A range that fits the third alone.
    filter.update({}, {{1, std::hypot(5.0, 6.0), 0.01, Eigen::Vector3d::Zero()}});
    ASSERT_EQ(filter.particles().size(), 200);
    EXPECT_EQ(filter.status().particles, 200);
    for (Eigen::Index i = 0; i < 200; ++i) {
      const double x = filter.particles().x[i];
      EXPECT_TRUE(x == 1.0 || x == 5.0) << x;
    }
    EXPECT_GT((filter.particles().x == 5.0).count(), 190);
  }
}

// What has been learnt of scale and bias is not forgotten.
TEST(GivenParticles, BeaconMclKeepsWhatItKnowsOfCalibration) {
  BeaconMclOptions options;
  options.particles = 300;
  options.calibration.estimation = CalibrationEstimation::shared;
  options.yaw_rate_bias.estimate = true;
  BeaconMcl filter(options, kBeacons, 1);
  filter.initialize_gaussian({5.0, 5.0, 0.0}, 0.01 * Eigen::Matrix3d::Identity());
  for (int i = 0; i < 40; ++i) {  // ranges that are 0.5 m too long
    const bool first = i % 2 == 0;
    const double range = 0.5 + (first ? std::hypot(5.0, 5.0) : std::hypot(15.0, 5.0));
    filter.update({}, {{first ? 1 : 2, range, 0.0, Eigen::Vector3d::Zero()}});
  }
  const CalibrationEstimate before = filter.calibration().front();
  ASSERT_GT(before.bias, 0.1);
  GivenParticles particles;
  for (int i = 0; i < 300; ++i) particles.poses.push_back({5.0 + 0.001 * i, 5.0, 0.1});
  filter.set_particles(particles);
  const CalibrationEstimate after = filter.calibration().front();
  // Systematic resampling of 300 gives the mean to a fraction of the spread.
  EXPECT_NEAR(after.bias, before.bias, 0.2 * before.bias_sigma);
  EXPECT_NEAR(after.scale, before.scale, 0.2 * before.scale_sigma);
}

TEST(GivenParticles, FastSlamTakesThemWithTheMapThatIsThere) {
  FastSlamOptions options;
  options.particles = 50;
  options.strategy.excitation.method = Excitation::none;
  FastSlam filter(options, 1);
  RangeBearingObservation seen = {7, 5.0, 0.3};
  for (int i = 0; i < 5; ++i) filter.update({}, {seen});
  const LandmarkEstimate before = filter.map().front();
  GivenParticles wrong = three();
  wrong.poses[2].heading = kInfinity;
  EXPECT_THROW(filter.set_particles(wrong), Error);
  EXPECT_EQ(filter.particles().size(), 50);
  filter.set_particles(three());
  expect_given(filter);
  ASSERT_EQ(filter.map().size(), 1u);
  const LandmarkEstimate after = filter.map().front();
  EXPECT_EQ(after.id, 7);
  EXPECT_NEAR((after.mean - before.mean).norm(), 0.0, 3.0 * std::sqrt(before.covariance.trace()));
  // Goes on, with its own number of particles from the first scan on.
  filter.update({}, {seen});
  EXPECT_EQ(filter.particles().size(), 50);
  EXPECT_EQ(filter.status().particles, 50);
  EXPECT_TRUE(filter.particles().x.allFinite());
}

}  // namespace
}  // namespace pf_resampling
