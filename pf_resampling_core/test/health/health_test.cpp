#include "pf_resampling_core/health/health.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/health/unknown_place.hpp"
#include "pf_resampling_core/test/says.hpp"

namespace pf_resampling {
namespace {

Health health_of(const HealthInputs& inputs) {
  return judge_health(inputs).health;
}

TEST(Health, AFilterThatIsWellIsHealthy) {
  const HealthJudgement judgement = judge_health({});
  EXPECT_EQ(judgement.health, Health::healthy);
  EXPECT_EQ(judgement.reason, "");
  EXPECT_EQ(sentence_of(judgement), "Healthy");
}

TEST(Health, WithoutABeliefItIsStarting) {
  HealthInputs inputs;
  inputs.has_belief = false;
  inputs.waits_for = "the beacons";
  inputs.remedy = "Provide them.";
  inputs.lost = 1.0;
  EXPECT_EQ(sentence_of(judge_health(inputs)), "Starting: waiting for the beacons. Provide them.");
}

TEST(Health, WhatIsSeenHasToFit) {
  HealthInputs inputs;
  inputs.observations = "ranges";
  inputs.lost = 0.5;
  EXPECT_EQ(health_of(inputs), Health::healthy);
  inputs.lost = 0.51;
  EXPECT_EQ(health_of(inputs), Health::lost);
  EXPECT_EQ(judge_health(inputs).reason, "the ranges contradict the belief: lost?");
  // Whatever else is wrong with it.
  inputs.sample_size = inputs.descendants = 0.0;
  inputs.position_unknown = 1.0;
  EXPECT_EQ(health_of(inputs), Health::lost);
}

// 1 - exp(-(sigma / (a tenth of 360 degrees))^2): 36 degrees give 1 - 1/e.
TEST(Health, AHeadingCountsAsUnknownFromThirtyDegreesOn) {
  const double degree = kPi / 180.0;
  EXPECT_NEAR(unknown_heading_probability(36.0 * degree), 1.0 - std::exp(-1.0), 1e-12);
  EXPECT_EQ(unknown_heading_probability(0.0), 0.0);
  HealthInputs inputs;
  for (const double sigma : {2.0, 10.0, 29.0}) {
    inputs.heading_unknown = unknown_heading_probability(sigma * degree);
    EXPECT_EQ(health_of(inputs), Health::healthy) << sigma;
  }
  for (const double sigma : {31.0, 62.0, 102.0, 180.0}) {
    inputs.heading_unknown = unknown_heading_probability(sigma * degree);
    EXPECT_EQ(health_of(inputs), Health::converging) << sigma;
    EXPECT_EQ(judge_health(inputs).reason, "the heading is uncertain by a large part of a turn");
  }
}

TEST(Health, PositionAndHeadingAreJudgedTogether) {
  HealthInputs inputs;
  inputs.position_unknown = 0.6;
  EXPECT_EQ(health_of(inputs), Health::converging);
  EXPECT_EQ(judge_health(inputs).reason, "the position is uncertain by a large part of the scene");
  // Who knows neither hears of the position first.
  inputs.heading_unknown = 1.0;
  EXPECT_EQ(judge_health(inputs).reason, "the position is uncertain by a large part of the scene");
  // 1 - 0.6 * 0.7 = 0.58, and 1 - 0.8 * 0.7 = 0.44.
  inputs.position_unknown = 0.4;
  inputs.heading_unknown = 0.3;
  EXPECT_EQ(health_of(inputs), Health::converging);
  inputs.position_unknown = 0.2;
  EXPECT_EQ(health_of(inputs), Health::healthy);
}

// The belief may be that of the beacon that was moved.
TEST(Health, WhatContradictsTheBeliefOrTheOthersMakesItDoubtful) {
  HealthInputs inputs;
  inputs.observations = "scans";
  inputs.is_contradicted = true;
  EXPECT_EQ(health_of(inputs), Health::doubtful);
  EXPECT_EQ(judge_health(inputs).reason,
            "odometry and scans contradict each other: slipping, or carried?");
  inputs.lost = 0.9;
  EXPECT_EQ(health_of(inputs), Health::lost);
  inputs = {};
  inputs.misfit = "the ranges of a beacon";
  inputs.sample_size = 0.01;
  EXPECT_EQ(health_of(inputs), Health::doubtful);
  EXPECT_EQ(judge_health(inputs).reason,
            "the ranges of a beacon contradict the others: moved, reflected, or faulty?");
  inputs.position_unknown = 0.6;
  EXPECT_EQ(health_of(inputs), Health::converging);
}

// N_eff 1.0 of 500.
TEST(Health, FewParticlesWithWeightAreADegeneratePopulation) {
  HealthInputs inputs;
  inputs.sample_size = 1.0 / 500.0;
  EXPECT_EQ(health_of(inputs), Health::degenerate);
  inputs.sample_size = kFewParticles;
  EXPECT_EQ(health_of(inputs), Health::healthy);
}

// 2 of 1000 ancestors: that of a filter which knows where things are does not matter.
TEST(Health, AMapsPastThatIsOneHistoryIsDepletedUnlessItComesBack) {
  HealthInputs inputs;
  inputs.histories = 2.0 / 1000.0;
  EXPECT_EQ(health_of(inputs), Health::healthy);
  inputs.needs_past = true;
  EXPECT_EQ(health_of(inputs), Health::depleted);
  EXPECT_TRUE(says(judge_health(inputs).remedy, "redraw"));
  inputs.renews_past = true;
  EXPECT_EQ(health_of(inputs), Health::healthy);
  inputs.renews_past = false;
  inputs.histories = kFewParticles;
  EXPECT_EQ(health_of(inputs), Health::healthy);
}

TEST(Health, FewDescendantsOfTheLastRenewalAreADepletedPopulation) {
  HealthInputs inputs;
  inputs.descendants = 0.03;
  EXPECT_EQ(health_of(inputs), Health::depleted);
  inputs.renews_past = true;
  EXPECT_EQ(health_of(inputs), Health::depleted);
}

TEST(Health, SlownessIsSaidWhenNothingElseIsWrong) {
  HealthInputs inputs;
  inputs.keeps_up = false;
  EXPECT_EQ(health_of(inputs), Health::too_slow);
  EXPECT_EQ(sentence_of(judge_health(inputs)).rfind("Too slow: ", 0), 0u);
  inputs.sample_size = 0.01;
  EXPECT_EQ(health_of(inputs), Health::degenerate);
}

// Reasons stand in the diagnostics, where another text is another alarm: they hold no figures.
TEST(Health, EveryJudgementHasItsReasonAndRemedy) {
  std::vector<HealthInputs> ill(11);
  ill[0].has_belief = false;
  ill[0].waits_for = "odometry";
  ill[0].remedy = "Provide it.";
  ill[1].lost = 1.0;
  ill[2].heading_unknown = 1.0;
  ill[3].sample_size = 0.0;
  ill[4].descendants = 0.0;
  ill[5].histories = 0.0;
  ill[5].needs_past = true;
  ill[6].keeps_up = false;
  ill[7].misfit = "the ranges of a beacon";
  ill[8].map_is_wrong = true;
  ill[9].misses_landmarks = true;
  ill[10].odometry_is_wrong = true;
  std::set<std::string> reasons;
  std::set<Health> said = {Health::healthy};
  for (const HealthInputs& inputs : ill) {
    const HealthJudgement judgement = judge_health(inputs);
    said.insert(judgement.health);
    EXPECT_FALSE(judgement.reason.empty());
    EXPECT_EQ(judgement.remedy.back(), '.');
    EXPECT_EQ(judgement.reason.find_first_of("0123456789"), std::string::npos);
    EXPECT_TRUE(reasons.insert(judgement.reason).second) << judgement.reason;
  }
  EXPECT_EQ(said.size(), all_values<Health>().size());
}

// A step from 0 to 1 that lasts for three seconds counts 1 - 1/e, in however many parts it comes.
TEST(RecentMean, RemembersAboutThreeSeconds) {
  for (const int parts : {1, 10, 300}) {
    RecentMean mean;
    EXPECT_EQ(mean.value(), 1.0);
    mean.add(0.0, 5.0);
    EXPECT_EQ(mean.value(), 0.0);
    for (int i = 0; i < parts; ++i) mean.add(1.0, 3.0 / parts);
    EXPECT_NEAR(mean.value(), 1.0 - std::exp(-1.0), 1e-12);
    mean.add(std::numeric_limits<double>::quiet_NaN(), 1.0);
    mean.add(0.0, -1.0);
    EXPECT_NEAR(mean.value(), 1.0 - std::exp(-1.0), 1e-12);
  }
}

}  // namespace
}  // namespace pf_resampling
