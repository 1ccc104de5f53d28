#include "pf_resampling_core/strategy/strategy.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "pf_resampling_core/test/strategy/weight_families.hpp"

namespace pf_resampling {
namespace {

constexpr int kSize = 100;

StrategyOptions with(Schedule schedule, double threshold = 0.5, int every_n = 1) {
  StrategyOptions options;
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

// Kwak section 4.2: when N_eff < T_N M; section 5.2: T_N >= 1 means after every observation, so
// also when N_eff = M.
TEST(Strategy, IsDueAsTheScheduleSays) {
  const auto is_due = [](const StrategyOptions& options, double effective_sample_size) {
    return Strategy(options).is_due(effective_sample_size, kSize, kSize);
  };
  const auto by_size = [](double threshold) {
    return with(Schedule::effective_sample_size, threshold);
  };
  EXPECT_FALSE(is_due(with(Schedule::never), 1.0));
  EXPECT_TRUE(is_due(with(Schedule::always), kSize));
  EXPECT_TRUE(is_due(with(Schedule::every_n, 0.5, 1), kSize));
  EXPECT_FALSE(is_due(by_size(0.75), kSize));
  EXPECT_FALSE(is_due(by_size(0.75), 75.0));
  EXPECT_TRUE(is_due(by_size(0.75), 74.999));
  EXPECT_TRUE(is_due(by_size(1.0), kSize));
}

// Kwak section 5: compensation runs instead of resampling, by the same schedules, and counts as a
// call.
TEST(Strategy, EveryThirdObservationByEitherWay) {
  StrategyOptions options = with(Schedule::every_n, 0.5, 3);
  options.compensation.ratio = 0.2;
  Strategy strategy(options);
  const Eigen::ArrayXd weights = rising_weights(kSize);
  for (int round = 0; round < 4; ++round) {
    EXPECT_FALSE(strategy.is_due(1.0, kSize, kSize));
    EXPECT_FALSE(strategy.is_due(1.0, kSize, kSize));
    EXPECT_TRUE(strategy.is_due(1.0, kSize, kSize));
    if (round % 2 == 0) {
      strategy.select(weights, kSize, stream(0));
      continue;
    }
    const CompensationResult result = strategy.compensate(weights, stream(0));
    // A fifth of the weak half of a hundred, the worst with the best.
    ASSERT_EQ(result.pairs.size(), 10u);
    EXPECT_EQ(result.pairs.front().low, 0);
    EXPECT_EQ(result.pairs.front().high, kSize - 1);
    EXPECT_DOUBLE_EQ(result.pairs.front().share, 1.0 / 101.0);
  }
  EXPECT_EQ(strategy.renewals(), 4);
}

TEST(Strategy, AnotherSizeIsDueUnderEveryScheduleAndNothingWithoutRenewal) {
  for (const Schedule schedule : all_values<Schedule>()) {
    StrategyOptions options = with(schedule, 1.0, 1000);
    for (const int requested : {kSize - 1, kSize + 1}) {
      options.renewal = Renewal::resampling;
      EXPECT_TRUE(Strategy(options).is_due(kSize, kSize, requested)) << to_string(schedule);
      options.renewal = Renewal::none;
      EXPECT_FALSE(Strategy(options).is_due(1.0, kSize, requested)) << to_string(schedule);
    }
    EXPECT_FALSE(Strategy(options).is_due(1.0, kSize, kSize)) << to_string(schedule);
  }
}

// What throws has renewed nothing.
TEST(Strategy, RenewalsThatFailDoNotCount) {
  StrategyOptions options = with(Schedule::every_n, 0.5, 2);
  options.renewal = Renewal::compensation;
  Strategy strategy(options);
  EXPECT_FALSE(strategy.is_due(1.0, kSize, kSize));
  const Eigen::ArrayXd nothing = Eigen::ArrayXd::Zero(kSize);
  EXPECT_THROW(strategy.select(nothing, kSize, stream(0)), Error);
  EXPECT_THROW(strategy.compensate(nothing, stream(0)), Error);
  EXPECT_EQ(strategy.renewals(), 0);
  EXPECT_EQ(strategy.observations_since_renewal(), 1);
  EXPECT_TRUE(strategy.is_due(1.0, kSize, kSize));
}

TEST(Strategy, CountsGoOnUnderOtherOptions) {
  Strategy strategy(with(Schedule::always));
  for (int i = 0; i < 5; ++i) strategy.select(rising_weights(kSize), kSize, stream(0));
  EXPECT_TRUE(strategy.is_due(1.0, kSize, kSize));
  strategy.set_options(with(Schedule::every_n, 0.5, 3));
  EXPECT_EQ(strategy.renewals(), 5);
  // One observation was asked about before the change: two more make three.
  EXPECT_FALSE(strategy.is_due(1.0, kSize, kSize));
  EXPECT_TRUE(strategy.is_due(1.0, kSize, kSize));
  strategy.select(rising_weights(kSize), kSize, stream(0));
  EXPECT_EQ(strategy.renewals(), 6);
}

TEST(Strategy, RefusesImpossibleOptionsAndKeepsTheOldOnes) {
  Strategy strategy(with(Schedule::every_n, 0.25, 7));
  const auto expect_refused = [&](const StrategyOptions& options, const char* part) {
    EXPECT_TRUE(says(refusal([&] { strategy.set_options(options); }), part));
    EXPECT_THROW(Strategy other(options), Error);
    EXPECT_EQ(strategy.options().schedule, Schedule::every_n);
    EXPECT_EQ(strategy.options().threshold, 0.25);
    EXPECT_EQ(strategy.options().every_n, 7);
  };
  expect_refused(with(Schedule::always, 0.0), "threshold");
  expect_refused(with(Schedule::always, 1.01), "threshold is '1.01'");
  expect_refused(with(Schedule::always, std::numeric_limits<double>::quiet_NaN()), "threshold");
  expect_refused(with(Schedule::always, 0.5, 0), "every_n is '0'");
  StrategyOptions nested;
  nested.resampling.inner_scheme = ResamplingScheme::partial;
  expect_refused(nested, "inner_scheme");
  for (const double tempering : {0.0, 1.1, std::numeric_limits<double>::quiet_NaN()}) {
    StrategyOptions tempered;
    tempered.tempering = tempering;
    expect_refused(tempered, "tempering");
  }
  for (const double ratio : {-0.1, 1.1, std::numeric_limits<double>::quiet_NaN()}) {
    StrategyOptions compensating;
    compensating.compensation.ratio = ratio;
    expect_refused(compensating, "ratio");
  }
}

TEST(Strategy, SelectsAsManyAsAskedForUnderEveryScheme) {
  for (const ResamplingScheme scheme : all_values<ResamplingScheme>()) {
    for (const ResamplingScheme inner : {ResamplingScheme::systematic, ResamplingScheme::killing}) {
      for (const int requested : {kSize, 1, 37, 250}) {
        SCOPED_TRACE(to_string(scheme) + " with " + to_string(inner) + " to " +
                     std::to_string(requested));
        StrategyOptions options;
        options.resampling.scheme = scheme;
        options.resampling.inner_scheme = inner;
        Strategy strategy(options);
        const Eigen::ArrayXd weights = rising_weights(kSize);
        expect_sound(weights, requested, strategy.select(weights, requested, stream(3)));
      }
    }
  }
}

// A filter that is nothing but poses: what a renewal does to a population, whoever owns it.
struct ToyFilter {
  explicit ToyFilter(int size)
      : x(Eigen::ArrayXd::LinSpaced(size, 0.0, size - 1.0)),
        y(Eigen::ArrayXd::Zero(size)),
        heading(Eigen::ArrayXd::Zero(size)),
        log_weight(rising_weights(size).log()),
        weight(rising_weights(size)),
        ancestor(Eigen::ArrayXi::Zero(size)) {}

  RenewalOutcome renew(Strategy* strategy, double effective_sample_size, int requested_size,
                       bool is_urgent) {
    const auto take = [](ConstIndices ancestors, Eigen::ArrayXd* array) {
      const Eigen::ArrayXd before = *array;
      array->resize(ancestors.size());
      for (Eigen::Index i = 0; i < ancestors.size(); ++i) (*array)[i] = before[ancestors[i]];
    };
    Population population{&x, &y, &heading, &log_weight, &weight, &ancestor, nullptr, nullptr};
    population.select = [&](ConstIndices ancestors) {
      for (Eigen::ArrayXd* array : {&x, &y, &heading}) take(ancestors, array);
    };
    population.blend = [&](const std::vector<BlendPair>& pairs) {
      blend_poses(pairs, x, y, heading);
    };
    return strategy->renew(
        effective_sample_size, requested_size, is_urgent,
        [](RandomPurpose purpose) { return RandomStream(11, purpose, 5); }, population);
  }

  Eigen::ArrayXd x, y, heading, log_weight, weight;
  Eigen::ArrayXi ancestor;
};

StrategyOptions without_excitation(Renewal renewal) {
  StrategyOptions options;
  options.renewal = renewal;
  options.excitation.method = Excitation::none;
  return options;
}

TEST(Strategy, RenewLeavesThePopulationAloneWhileNothingIsDue) {
  Strategy strategy(without_excitation(Renewal::resampling));
  ToyFilter filter(kSize);
  const ToyFilter before = filter;
  const RenewalOutcome outcome = filter.renew(&strategy, kSize, kSize, false);
  EXPECT_FALSE(outcome.renewed);
  EXPECT_TRUE((filter.x == before.x).all());
  EXPECT_TRUE((filter.weight == before.weight).all());
  EXPECT_EQ(strategy.renewals(), 0);
  EXPECT_EQ(strategy.observations_since_renewal(), 1);
}

// The particle in slot i was at x = i, so afterwards x names the ancestor. For another size so
// under compensation, too: there is nobody to blend a particle with that is not there yet.
TEST(Strategy, RenewSelectsAndSetsWeightsAndAncestors) {
  for (const auto& [renewal, requested] :
       {std::pair(Renewal::resampling, kSize), std::pair(Renewal::resampling, 37),
        std::pair(Renewal::resampling, 250), std::pair(Renewal::compensation, 130)}) {
    Strategy strategy(without_excitation(renewal));
    ToyFilter filter(kSize);
    const RenewalOutcome outcome = filter.renew(&strategy, 1.0, requested, false);
    EXPECT_TRUE(outcome.renewed);
    ASSERT_EQ(filter.x.size(), requested);
    ASSERT_EQ(filter.ancestor.size(), requested);
    EXPECT_TRUE((filter.x == filter.ancestor.cast<double>()).all());
    EXPECT_TRUE((filter.weight - 1.0 / requested).abs().maxCoeff() < 1e-15);
    EXPECT_TRUE((filter.log_weight.exp() == filter.weight).all());
    std::vector<std::uint8_t> seen;
    EXPECT_EQ(outcome.distinct_ancestors, count_distinct(filter.ancestor, kSize, &seen));
    EXPECT_EQ(strategy.renewals(), 1);
    EXPECT_EQ(strategy.observations_since_renewal(), 0);
  }
}

// Weights 1, 2, …, 100: the worst is blended with the best in the ratio 1 to 100 (Kwak eqs. 7, 8).
TEST(Strategy, RenewBlendsUnderCompensation) {
  Strategy strategy(without_excitation(Renewal::compensation));
  ToyFilter filter(kSize);
  const RenewalOutcome outcome = filter.renew(&strategy, 1.0, kSize, false);
  EXPECT_TRUE(outcome.renewed);
  EXPECT_EQ(outcome.distinct_ancestors, kSize);
  EXPECT_NEAR(filter.x[0], 99.0 * 100.0 / 101.0, 1e-12);
  EXPECT_EQ(filter.x[99], 99.0);
  EXPECT_TRUE((filter.ancestor == Eigen::ArrayXi::LinSpaced(kSize, 0, kSize - 1)).all());
  EXPECT_TRUE((filter.weight - 0.01).abs().maxCoeff() < 1e-15);
}

TEST(Strategy, RenewExcitesAfterwards) {
  StrategyOptions options;
  options.excitation.method = Excitation::gaussian;
  options.excitation.sigma_position = 0.01;  // beyond 0.4 once in 10^300
  options.excitation.sigma_heading = 0.0;
  Strategy strategy(options);
  ToyFilter filter(kSize);
  EXPECT_TRUE(filter.renew(&strategy, 1.0, kSize, false).renewed);
  EXPECT_TRUE((filter.x != filter.ancestor.cast<double>()).all());
  EXPECT_TRUE((filter.x - filter.ancestor.cast<double>()).abs().maxCoeff() < 0.4);
  EXPECT_TRUE((filter.heading == 0.0).all());
}

TEST(Strategy, AnUrgentRenewalComesBeforeItIsDueUnlessThereIsToBeNone) {
  for (const Schedule schedule : all_values<Schedule>()) {
    for (const Renewal renewal : all_values<Renewal>()) {
      StrategyOptions options = without_excitation(renewal);
      options.schedule = schedule;
      options.every_n = 1000;
      Strategy strategy(options);
      ToyFilter filter(kSize);
      const bool may_renew = schedule != Schedule::never && renewal != Renewal::none;
      EXPECT_EQ(filter.renew(&strategy, kSize, kSize, true).renewed, may_renew)
          << to_string(schedule) << ", " << to_string(renewal);
    }
  }
}

// A redraw is due after every_n updates and at closures; one that is refused waits as long again,
// and what the schedule asks for is done as by resampling.
TEST(Strategy, RedrawsWhenItIsDueAndResamplesMeanwhile) {
  StrategyOptions options = without_excitation(Renewal::redraw);
  options.schedule = Schedule::every_n;
  options.every_n = 2;
  options.redraw.every_n = 5;
  options.redraw.closure_absence = 3;
  options.redraw.closure_spacing = 2;
  ToyFilter filter(kSize);
  Population population{&filter.x,          &filter.y,      &filter.heading,
                        &filter.log_weight, &filter.weight, &filter.ancestor};
  bool is_refused = false;
  std::vector<int> asked;
  int selections = 0;
  population.select = [&](ConstIndices) { ++selections; };
  population.redraw = [&](int size) {
    asked.push_back(size);
    return !is_refused;
  };
  const auto streams = [](RandomPurpose purpose) { return RandomStream(1, purpose, 0); };
  Strategy strategy(options);
  const auto renew = [&] { return strategy.renew(kSize, kSize, false, streams, population); };

  for (int update = 1; update <= 4; ++update) EXPECT_FALSE(renew().redrawn);
  EXPECT_EQ(selections, 2);
  const RenewalOutcome outcome = renew();
  EXPECT_TRUE(outcome.renewed && outcome.redrawn);
  EXPECT_EQ(outcome.distinct_ancestors, kSize);
  EXPECT_EQ(asked, std::vector<int>{kSize});
  EXPECT_EQ(strategy.renewals(), 3);

  population.closes_loop = true;
  EXPECT_FALSE(renew().redrawn);  // too soon
  EXPECT_TRUE(renew().redrawn);
  population.closes_loop = false;
  is_refused = true;
  for (int update = 1; update <= 9; ++update) EXPECT_FALSE(renew().redrawn);
  EXPECT_EQ(asked.size(), 3u) << "refused once, and not asked again at once";
  EXPECT_EQ(selections, 6);

  population.redraw = nullptr;  // as a filter that cannot, or not now
  for (int update = 1; update <= 9; ++update) EXPECT_FALSE(renew().redrawn);
}

TEST(Strategy, EveryChoiceIsReadAsItIsWritten) {
  StrategyOptions options;
  ParameterList parameters;
  add_parameters(&options, all_values<Renewal>(), &parameters);
  int choices = 0;
  for (const Parameter& parameter : parameters) {
    for (const std::string& choice : parameter.choices) {
      parameter.set_checked(choice);
      EXPECT_EQ(parameter.get(), choice) << parameter.name;
      ++choices;
    }
    if (parameter.choices.empty()) continue;
    EXPECT_THROW(parameter.set_checked("sytematic"), Error) << parameter.name;
  }
  EXPECT_GT(choices, 30);
}

TEST(Strategy, IsSummedUpInALine) {
  StrategyOptions options;
  EXPECT_EQ(strategy_of(options),
            "effective_sample_size < 0.5, resampling systematic, regularized");
  options.schedule = Schedule::every_n;
  options.every_n = 5;
  options.renewal = Renewal::compensation;
  options.compensation.ratio = 0.2;
  options.excitation.method = Excitation::none;
  EXPECT_EQ(strategy_of(options), "every_n 5, compensation rank 20 %, none");
}

}  // namespace
}  // namespace pf_resampling
