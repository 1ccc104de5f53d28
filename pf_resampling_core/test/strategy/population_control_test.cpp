#include "pf_resampling_core/strategy/population_control.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

constexpr int kSize = 100;

PopulationControlOptions with(Schedule schedule, double threshold = 0.5, int every_n = 1) {
  PopulationControlOptions options;
  options.schedule = schedule;
  options.threshold = threshold;
  options.every_n = every_n;
  return options;
}

// Weights in proportion to 1, 2, …, size.
Eigen::ArrayXd rising_weights(int size) {
  const Eigen::ArrayXd weights = Eigen::ArrayXd::LinSpaced(size, 1.0, size);
  return weights / weights.sum();
}

RandomStream stream(std::uint32_t step) {
  return {11, RandomPurpose::test, step};
}

TEST(PopulationControl, NeverIsNeverDue) {
  PopulationControl control(with(Schedule::never));
  for (int i = 0; i < 20; ++i) EXPECT_FALSE(control.is_due(1.0, kSize, kSize));
}

TEST(PopulationControl, AlwaysIsDueAfterEveryObservation) {
  PopulationControl control(with(Schedule::always));
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(control.is_due(kSize, kSize, kSize));
}

// K section 4.2: when N_eff < T_N M.
TEST(PopulationControl, EffectiveSampleSizeBelowTheThreshold) {
  PopulationControl control(with(Schedule::effective_sample_size, 0.75));
  EXPECT_FALSE(control.is_due(kSize, kSize, kSize));
  EXPECT_FALSE(control.is_due(75.0, kSize, kSize));
  EXPECT_TRUE(control.is_due(74.999, kSize, kSize));
  EXPECT_TRUE(control.is_due(1.0, kSize, kSize));
}

// K section 5.2: T_N >= 1 means after every observation, so also when N_eff = M.
TEST(PopulationControl, ThresholdOfOneMeansAlways) {
  PopulationControl control(with(Schedule::effective_sample_size, 1.0));
  EXPECT_TRUE(control.is_due(kSize, kSize, kSize));
  EXPECT_TRUE(control.is_due(50.0, kSize, kSize));
}

TEST(PopulationControl, EveryThirdObservation) {
  PopulationControl control(with(Schedule::every_n, 0.5, 3));
  for (int round = 0; round < 4; ++round) {
    EXPECT_FALSE(control.is_due(1.0, kSize, kSize));
    EXPECT_FALSE(control.is_due(1.0, kSize, kSize));
    EXPECT_TRUE(control.is_due(1.0, kSize, kSize));
    control.select(rising_weights(kSize), kSize, stream(0));
  }
  EXPECT_EQ(control.calls(), 4);
}

TEST(PopulationControl, EveryOneIsAlways) {
  PopulationControl control(with(Schedule::every_n, 0.5, 1));
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(control.is_due(kSize, kSize, kSize));
    control.select(rising_weights(kSize), kSize, stream(0));
  }
}

TEST(PopulationControl, AnotherSizeIsDueUnderEverySchedule) {
  for (const Schedule schedule : all_schedules()) {
    PopulationControl control(with(schedule, 0.5, 1000));
    EXPECT_TRUE(control.is_due(kSize, kSize, kSize + 1)) << to_string(schedule);
    EXPECT_TRUE(control.is_due(kSize, kSize, kSize - 1)) << to_string(schedule);
  }
}

TEST(PopulationControl, RenewalNoneIsNeverDue) {
  for (const Schedule schedule : all_schedules()) {
    PopulationControlOptions options = with(schedule, 1.0, 1);
    options.renewal = Renewal::none;
    PopulationControl control(options);
    EXPECT_FALSE(control.is_due(1.0, kSize, kSize)) << to_string(schedule);
    EXPECT_FALSE(control.is_due(1.0, kSize, 2 * kSize)) << to_string(schedule);
  }
}

// K section 5: compensation runs instead of resampling, by the same schedules, and counts as a
// call.
TEST(PopulationControl, CompensationIsARenewalLikeTheOther) {
  PopulationControlOptions options = with(Schedule::every_n, 0.5, 3);
  options.renewal = Renewal::compensation;
  options.compensation.ratio = 0.2;
  PopulationControl control(options);
  const Eigen::ArrayXd weights = rising_weights(kSize);
  for (int round = 0; round < 3; ++round) {
    EXPECT_FALSE(control.is_due(1.0, kSize, kSize));
    EXPECT_FALSE(control.is_due(1.0, kSize, kSize));
    EXPECT_TRUE(control.is_due(1.0, kSize, kSize));
    const CompensationResult& result = control.compensate(weights, stream(0));
    // A fifth of the weak half of a hundred, the worst with the best.
    ASSERT_EQ(result.pairs.size(), 10u);
    EXPECT_EQ(result.pairs.front().low, 0);
    EXPECT_EQ(result.pairs.front().high, kSize - 1);
    EXPECT_DOUBLE_EQ(result.pairs.front().share, 1.0 / 101.0);
  }
  EXPECT_EQ(control.calls(), 3);
}

TEST(PopulationControl, CountsGoOnUnderOtherOptions) {
  PopulationControl control(with(Schedule::always));
  for (int i = 0; i < 5; ++i) control.select(rising_weights(kSize), kSize, stream(0));
  EXPECT_TRUE(control.is_due(1.0, kSize, kSize));
  control.set_options(with(Schedule::every_n, 0.5, 3));
  EXPECT_EQ(control.calls(), 5);
  // One observation was asked about before the change: two more make three.
  EXPECT_FALSE(control.is_due(1.0, kSize, kSize));
  EXPECT_TRUE(control.is_due(1.0, kSize, kSize));
  control.select(rising_weights(kSize), kSize, stream(0));
  EXPECT_EQ(control.calls(), 6);
}

TEST(PopulationControl, RefusesImpossibleOptionsAndKeepsTheOldOnes) {
  PopulationControl control(with(Schedule::every_n, 0.25, 7));
  const auto expect_refused = [&](const PopulationControlOptions& options, const char* part) {
    try {
      control.set_options(options);
      ADD_FAILURE() << "taken: " << part;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
    EXPECT_THROW(PopulationControl other(options), Error);
    EXPECT_EQ(control.options().schedule, Schedule::every_n);
    EXPECT_EQ(control.options().threshold, 0.25);
    EXPECT_EQ(control.options().every_n, 7);
  };
  expect_refused(with(Schedule::always, 0.0), "threshold");
  expect_refused(with(Schedule::always, 1.01), "threshold is 1.01");
  expect_refused(with(Schedule::always, std::numeric_limits<double>::quiet_NaN()), "threshold");
  expect_refused(with(Schedule::always, 0.5, 0), "every_n is 0");
  PopulationControlOptions nested;
  nested.resampling.inner_scheme = ResamplingScheme::partial;
  expect_refused(nested, "inner_scheme");
  for (const double ratio : {0.0, 1.1, std::numeric_limits<double>::quiet_NaN()}) {
    PopulationControlOptions compensating;
    compensating.compensation.ratio = ratio;
    expect_refused(compensating, "ratio");
  }
}

TEST(PopulationControl, SelectsAsManyAsAskedForUnderEveryScheme) {
  for (const ResamplingScheme scheme : all_resampling_schemes()) {
    for (const ResamplingScheme inner : {ResamplingScheme::systematic, ResamplingScheme::killing}) {
      for (const int requested : {kSize, 1, 37, 250}) {
        SCOPED_TRACE(to_string(scheme) + " with " + to_string(inner) + " to " +
                     std::to_string(requested));
        PopulationControlOptions options;
        options.resampling.scheme = scheme;
        options.resampling.inner_scheme = inner;
        PopulationControl control(options);
        const Eigen::ArrayXd weights = rising_weights(kSize);
        const ResamplingResult result = control.select(weights, requested, stream(3));
        ASSERT_EQ(result.ancestors.size(), requested);
        ASSERT_EQ(result.counts.size(), kSize);
        EXPECT_EQ(result.counts.sum(), requested);
        Eigen::ArrayXi counted = Eigen::ArrayXi::Zero(kSize);
        for (int i = 0; i < requested; ++i) ++counted[result.ancestors[i]];
        EXPECT_TRUE((counted == result.counts).all());
        ASSERT_EQ(result.log_weights.size(), requested);
        EXPECT_NEAR(result.log_weights.exp().sum(), 1.0, 1e-12);
      }
    }
  }
}

// Where a scheme cannot give another number itself (partial, killing): what is selected instead
// has to stand for the same belief. Over T draws the weight that descendants of particle k hold has
// mean w_k and, for sampling with replacement or better, variance at most w_k / (M T). 100
// particles times 2 sizes times 3 schemes beyond 6.1 of these: false alarm below 1e-6.
TEST(PopulationControl, ChangingTheSizeIsUnbiasedUnderSchemesThatKeepIt) {
  constexpr int kTrials = 2000;
  struct Case {
    ResamplingScheme scheme;
    ResamplingScheme inner;
  };
  for (const Case& c : {Case{ResamplingScheme::partial, ResamplingScheme::multinomial},
                        Case{ResamplingScheme::partial, ResamplingScheme::killing},
                        Case{ResamplingScheme::killing, ResamplingScheme::systematic}}) {
    for (const int requested : {40, 230}) {
      PopulationControlOptions options;
      options.resampling.scheme = c.scheme;
      options.resampling.inner_scheme = c.inner;
      PopulationControl control(options);
      const Eigen::ArrayXd weights = rising_weights(kSize);
      Eigen::ArrayXd held = Eigen::ArrayXd::Zero(kSize);
      for (int trial = 0; trial < kTrials; ++trial) {
        const ResamplingResult result =
            control.select(weights, requested, stream(static_cast<std::uint32_t>(trial)));
        for (int i = 0; i < requested; ++i) {
          held[result.ancestors[i]] += std::exp(result.log_weights[i]) / kTrials;
        }
      }
      for (int k = 0; k < kSize; ++k) {
        const double deviation = std::sqrt(weights[k] / (requested * double{kTrials}));
        EXPECT_NEAR(held[k], weights[k], 6.1 * deviation)
            << to_string(c.scheme) << " to " << requested << ", particle " << k;
      }
    }
  }
}

TEST(PopulationControl, NamesAreReadAsTheyAreWritten) {
  for (const Schedule schedule : all_schedules()) {
    EXPECT_EQ(schedule_from_string(to_string(schedule)), schedule);
  }
  for (const Renewal renewal : all_renewals()) {
    EXPECT_EQ(renewal_from_string(to_string(renewal)), renewal);
  }
  EXPECT_EQ(all_schedules().size(), 4u);
  EXPECT_EQ(all_renewals().size(), 3u);
  try {
    schedule_from_string("allways");
    ADD_FAILURE();
  } catch (const Error& error) {
    const std::string text = error.what();
    for (const char* part : {"allways", "never", "always", "effective_sample_size", "every_n"}) {
      EXPECT_NE(text.find(part), std::string::npos) << text;
    }
  }
}

}  // namespace
}  // namespace pf_resampling
