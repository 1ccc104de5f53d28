#include "pf_resampling_core/health/health.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <string>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/health/unknown_place.hpp"

namespace pf_resampling {
namespace {

struct Case {
  const char* what;
  std::function<void(HealthInputs*)> change;  // of a filter that is well
  Health health;
  const char* reason = "";  // begins so
};

// In the order of their weight: what is worse is told first, whatever else is wrong.
const Case kCases[] = {
    {"well", [](HealthInputs*) {}, Health::healthy},
    {"without a belief",
     [](HealthInputs* i) {
       i->has_belief = false;
       i->waits_for = "the beacons";
       i->remedy = "Provide them.";
       i->lost = 1.0;
     },
     Health::starting, "waiting for the beacons"},
    {"perhaps lost", [](HealthInputs* i) { i->lost = 0.5; }, Health::healthy},
    {"lost", [](HealthInputs* i) { i->lost = 0.51; }, Health::lost,
     "the scans contradict the belief: lost?"},
    {"lost and all else",
     [](HealthInputs* i) {
       i->lost = 0.51;
       i->sample_size = i->descendants = 0.0;
       i->position_unknown = 1.0;
       i->is_contradicted = true;
     },
     Health::lost},
    {"unknown position", [](HealthInputs* i) { i->position_unknown = 0.6; }, Health::converging,
     "the position is uncertain by a large part of the scene"},
    {"unknown position and heading",
     [](HealthInputs* i) {
       i->position_unknown = 0.6;
       i->heading_unknown = 1.0;
       i->misfit = "the ranges of a beacon";
     },
     Health::converging, "the position"},
    // 1 - 0.6 * 0.7 = 0.58, and 1 - 0.8 * 0.7 = 0.44.
    {"either may be unknown",
     [](HealthInputs* i) {
       i->position_unknown = 0.4;
       i->heading_unknown = 0.3;
     },
     Health::converging},
    {"neither is unknown",
     [](HealthInputs* i) {
       i->position_unknown = 0.2;
       i->heading_unknown = 0.3;
     },
     Health::healthy},
    {"nowhere in the map", [](HealthInputs* i) { i->is_placed = false; }, Health::converging,
     "nothing that was seen shows"},
    {"contradicted", [](HealthInputs* i) { i->is_contradicted = true; }, Health::doubtful,
     "odometry and scans contradict each other: slipping, or carried?"},
    {"misses landmarks", [](HealthInputs* i) { i->misses_landmarks = true; }, Health::doubtful,
     "landmarks that should be in view"},
    {"a beacon that does not fit, and few particles with weight",
     [](HealthInputs* i) {
       i->misfit = "the ranges of a beacon";
       i->sample_size = 0.01;
     },
     Health::doubtful,
     "the ranges of a beacon contradict the others: moved, reflected, or faulty?"},
    {"a landmark was moved", [](HealthInputs* i) { i->map_is_wrong = true; }, Health::doubtful,
     "a landmark is not where"},
    {"wheels count wrong", [](HealthInputs* i) { i->odometry_is_wrong = true; }, Health::doubtful,
     "the odometry has a wrong scale"},
    {"N_eff of 1 in 500, and slow",
     [](HealthInputs* i) {
       i->sample_size = 1.0 / 500.0;
       i->keeps_up = false;
     },
     Health::degenerate, "few particles carry the weight"},
    {"enough with weight", [](HealthInputs* i) { i->sample_size = kFewParticles; },
     Health::healthy},
    {"few descendants, though redraws renew the past",
     [](HealthInputs* i) {
       i->descendants = 0.03;
       i->renews_past = true;
     },
     Health::depleted, "few particles have descendants"},
    // 2 of 1000 ancestors: that of a filter which knows where things are does not matter.
    {"one history of no matter", [](HealthInputs* i) { i->histories = 0.002; }, Health::healthy},
    {"one history of a map",
     [](HealthInputs* i) {
       i->histories = 0.002;
       i->needs_past = true;
     },
     Health::depleted, "particle diversity is nearly gone"},
    {"one history that comes back",
     [](HealthInputs* i) {
       i->histories = 0.002;
       i->needs_past = i->renews_past = true;
     },
     Health::healthy},
    {"slow", [](HealthInputs* i) { i->keeps_up = false; }, Health::too_slow,
     "updates take longer"}};

// Reasons stand in the diagnostics, where another text is another alarm: they hold no figures.
TEST(Health, IsTheWorstThatAppliesWithItsReasonAndRemedy) {
  std::set<Health> said;
  for (const Case& test : kCases) {
    SCOPED_TRACE(test.what);
    HealthInputs inputs;
    inputs.observations = "scans";
    test.change(&inputs);
    const HealthJudgement judgement = judge_health(inputs);
    said.insert(judgement.health);
    EXPECT_EQ(judgement.health, test.health);
    EXPECT_EQ(judgement.reason.rfind(test.reason, 0), 0u) << judgement.reason;
    EXPECT_EQ(judgement.reason.empty(), judgement.health == Health::healthy);
    if (judgement.reason.empty()) continue;
    EXPECT_EQ(judgement.remedy.back(), '.');
    EXPECT_EQ(judgement.reason.find_first_of("0123456789"), std::string::npos);
  }
  EXPECT_EQ(said.size(), all_values<Health>().size());
}

TEST(Health, IsASentence) {
  EXPECT_EQ(sentence_of(judge_health({})), "Healthy");
  EXPECT_EQ(sentence_of({Health::too_slow, "updates take long", "Use fewer."}),
            "Too slow: updates take long. Use fewer.");
  EXPECT_EQ(sentence_of({Health::lost, "carried off?", "Wait."}), "Lost: carried off? Wait.");
}

// 1 - exp(-(sigma / (a tenth of 360 degrees))^2): 36 degrees give 1 - 1/e.
TEST(Health, AHeadingCountsAsUnknownFromThirtyDegreesOn) {
  const double degree = kPi / 180.0;
  EXPECT_NEAR(unknown_heading_probability(36.0 * degree), 1.0 - std::exp(-1.0), 1e-12);
  EXPECT_EQ(unknown_heading_probability(0.0), 0.0);
  for (const double sigma : {2.0, 10.0, 29.0, 31.0, 62.0, 102.0, 180.0}) {
    HealthInputs inputs;
    inputs.heading_unknown = unknown_heading_probability(sigma * degree);
    const std::string reason = judge_health(inputs).reason;
    EXPECT_EQ(reason, sigma < 30.0 ? "" : "the heading is uncertain by a large part of a turn");
  }
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
