#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "pf_resampling_core/strategy/resampling.hpp"
#include "pf_resampling_core/test/strategy/weight_families.hpp"

/// Statistical tests of E[counts_k] = M w_k. A test of N particles looks at linear statistics of
/// the counts, sum_k counts_k phi_k, whose expectation is known: every particle by itself where
/// these are few; patterns that any known mistake disturbs where they are many. Over R independent
/// trials the mean must agree with its expectation.
///
/// False alarms: a statistic is rejected outside the empirical Bernstein bound (Maurer and Pontil
/// 2009, theorem 4) for kLogTwoOverDelta, a probability of 1e-10 each; there are fewer than 5000,
/// so that a false alarm anywhere in this file has a probability below 1e-6. The seeds are fixed.
namespace pf_resampling {
namespace {

constexpr double kLogTwoOverDelta = 23.7;

// Mean and variance over trials of several statistics.
class Statistics {
 public:
  explicit Statistics(std::size_t count) : sums_(count), squares_(count) {}

  void add(std::size_t which, double value) {
    sums_[which] += value;
    squares_[which] += value * value;
  }
  void end_trial() { ++trials_; }

  double mean(std::size_t which) const { return sums_[which] / trials_; }

  // Half width of the interval that holds the expectation, for values of this range.
  double bound(std::size_t which, double range) const {
    const double variance = std::max(0.0, squares_[which] / trials_ - mean(which) * mean(which)) *
                            trials_ / (trials_ - 1);
    return std::sqrt(2.0 * variance * kLogTwoOverDelta / trials_) +
           7.0 * range * kLogTwoOverDelta / (3.0 * (trials_ - 1));
  }

 private:
  std::vector<double> sums_;
  std::vector<double> squares_;
  double trials_ = 0.0;
};

struct Case {
  ResamplingScheme scheme;
  Weights family;
  int inputs;
  int size;
};

std::string case_name(const testing::TestParamInfo<Case>& info) {
  return to_string(info.param.scheme) + "_" + to_string(info.param.family) + "_" +
         std::to_string(info.param.inputs) + "_to_" + std::to_string(info.param.size);
}

bool is_unbiased_in_counts(ResamplingScheme scheme) {
  return scheme != ResamplingScheme::partial && scheme != ResamplingScheme::rank_based;
}

std::vector<Case> cases(const std::vector<std::pair<int, int>>& sizes) {
  std::vector<Case> all;
  for (const ResamplingScheme scheme : all_values<ResamplingScheme>()) {
    for (const Weights family : all_weights()) {
      for (const auto& [inputs, size] : sizes) {
        const bool must_keep =
            scheme == ResamplingScheme::killing || scheme == ResamplingScheme::partial;
        if (must_keep && inputs != size) continue;
        all.push_back({scheme, family, inputs, size});
      }
    }
  }
  return all;
}

// Counts in units of the weights they stand for: by themselves where a scheme is unbiased in its
// counts, weighted with the log-weights afterwards for the two that are unbiased only together with
// these.
Eigen::ArrayXd selected_mass(const ResamplingResult& result, bool by_counts) {
  const double size = static_cast<double>(result.ancestors.size());
  if (by_counts) return result.counts.cast<double>() / size;
  Eigen::ArrayXd mass = Eigen::ArrayXd::Zero(result.counts.size());
  for (Eigen::Index slot = 0; slot < result.ancestors.size(); ++slot) {
    mass[result.ancestors[slot]] += std::exp(result.log_weights[slot]);
  }
  return mass;
}

// Few particles one by one.
std::vector<Eigen::ArrayXd> each_of(Eigen::Index count) {
  std::vector<Eigen::ArrayXd> all(static_cast<std::size_t>(count), Eigen::ArrayXd::Zero(count));
  for (Eigen::Index k = 0; k < count; ++k) all[static_cast<std::size_t>(k)][k] = 1.0;
  return all;
}

// Patterns over many particles. Each is +-1, so that a trial's statistic lies in [-1, 1].
std::vector<Eigen::ArrayXd> patterns(const Eigen::ArrayXd& weights, int size) {
  const Eigen::Index count = weights.size();
  const double mean = 1.0 / static_cast<double>(count);
  std::vector<Eigen::ArrayXd> all;
  const auto add = [&](const auto& sign) {
    Eigen::ArrayXd pattern(count);
    for (Eigen::Index k = 0; k < count; ++k) pattern[k] = sign(k) ? 1.0 : -1.0;
    all.push_back(pattern);
  };
  Eigen::ArrayXd begins(count);  // where each particle's part of the running sum begins, in copies
  double sum = 0.0;
  for (Eigen::Index k = 0; k < count; ++k) {
    begins[k] = sum * size;
    sum += weights[k];
  }
  // Along the array: a mistake that favours the first or the last, or loses either.
  add([&](Eigen::Index k) { return k < count / 2; });
  add([&](Eigen::Index k) { return k < count / 16; });
  add([&](Eigen::Index k) { return k < 16; });
  add([&](Eigen::Index k) { return k >= count - 16; });
  add([&](Eigen::Index k) { return k % 2 == 0; });
  add([&](Eigen::Index k) { return k % 256 < 8; });
  // By weight: mistakes of rounding, of left-overs, of scale.
  for (const double bound : {0.01, 0.5, 1.0, 2.0}) {
    add([&, bound](Eigen::Index k) { return weights[k] < bound * mean; });
  }
  add([&](Eigen::Index k) { return std::fmod(weights[k] * size, 1.0) < 0.5; });
  // By place within the stratum: mistakes of its width and offset.
  for (const double bound : {0.1, 0.25, 0.5, 0.75, 0.9}) {
    add([&, bound](Eigen::Index k) { return std::fmod(begins[k], 1.0) < bound; });
    add([&, bound](Eigen::Index k) {
      return std::fmod(begins[k] + weights[k] * size, 1.0) < bound;
    });
  }
  // And at random.
  for (std::uint32_t draw = 0; draw < 4; ++draw) {
    const RandomStream stream(2, RandomPurpose::test, draw);
    add([&](Eigen::Index k) { return stream.uniform(static_cast<std::uint64_t>(k)) < 0.5; });
  }
  return all;
}

class Particles : public testing::TestWithParam<Case> {};

constexpr int kFew = 20;
INSTANTIATE_TEST_SUITE_P(
    Few, Particles,
    testing::ValuesIn(cases({{1, 1}, {2, 2}, {5, 5}, {7, 3}, {3, 8}, {kFew, kFew}})), case_name);
INSTANTIATE_TEST_SUITE_P(Many, Particles,
                         testing::ValuesIn(cases({{1000, 1000}, {1000, 300}, {300, 1000}})),
                         case_name);

// What differs from systematic, and can differ with the number.
std::vector<Case> cases_of_thousands() {
  std::vector<Case> all;
  for (const Case& item : cases({{100000, 100000}})) {
    const bool same = item.scheme == ResamplingScheme::residual_systematic ||
                      item.scheme == ResamplingScheme::residual_then_systematic;
    const bool of_interest = item.family == Weights::uniform || item.family == Weights::random ||
                             item.family == Weights::skewed || item.family == Weights::tied;
    if (of_interest && !same) all.push_back(item);
  }
  return all;
}
INSTANTIATE_TEST_SUITE_P(Thousands, Particles, testing::ValuesIn(cases_of_thousands()), case_name);

// Rank-based resampling with the weights w/p is self-normalised, hence unbiased only as the
// number grows; its counts have a test of their own.
TEST_P(Particles, AreTakenAsTheirWeightsSay) {
  const Case& parameters = GetParam();
  if (parameters.scheme == ResamplingScheme::rank_based) return;
  const bool are_few = parameters.inputs <= kFew;
  const int trials = are_few ? 20000 : parameters.inputs > 10000 ? 100 : 1000;
  const bool by_counts = is_unbiased_in_counts(parameters.scheme);
  const Eigen::ArrayXd weights = make_weights(parameters.family, parameters.inputs);
  const std::vector<Eigen::ArrayXd> all =
      are_few ? each_of(weights.size()) : patterns(weights, parameters.size);
  ResamplingOptions options;
  options.scheme = parameters.scheme;
  Resampler resampler(options);
  Statistics statistics(all.size());
  for (int trial = 0; trial < trials; ++trial) {
    const ResamplingResult result =
        resampler.resample(weights, parameters.size,
                           RandomStream(3, RandomPurpose::test, static_cast<std::uint32_t>(trial)));
    const Eigen::ArrayXd mass = selected_mass(result, by_counts);
    for (std::size_t i = 0; i < all.size(); ++i) statistics.add(i, (mass * all[i]).sum());
    statistics.end_trial();
  }
  // One count more or less is 1/M; of patterns of few particles ten are, those of many are normal.
  const double range = (are_few ? 1.0 : 10.0) / parameters.size;
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_NEAR(statistics.mean(i), (weights * all[i]).sum(), statistics.bound(i, range) + 1e-10)
        << (are_few ? "particle " : "pattern ") << i;
  }
}

// The inner scheme draws for rank_based and partial: with each of them the means stay.
class InnerScheme : public testing::TestWithParam<ResamplingScheme> {};

INSTANTIATE_TEST_SUITE_P(All, InnerScheme, testing::ValuesIn(inner_resampling_schemes()));

TEST_P(InnerScheme, KeepsTheMeansOfRankBasedAndPartial) {
  // Weights for partial, T_h = 2 and T_l = 0.5, mean 1/8: 0.3 above 0.25, three below 0.0625. These
  // four share 4 slots by weight; the other four keep theirs.
  Eigen::ArrayXd weights(8);
  weights << 0.02, 0.3, 0.15, 0.05, 0.14, 0.1, 0.2, 0.04;
  const double shared = 0.02 + 0.3 + 0.05 + 0.04;
  const double expected_partial[] = {
      4 * 0.02 / shared, 4 * 0.3 / shared, 1.0, 4 * 0.05 / shared, 1.0, 1.0, 1.0,
      4 * 0.04 / shared};
  const double ranks[] = {8, 1, 3, 6, 4, 5, 2, 7};
  for (const auto outer : {ResamplingScheme::partial, ResamplingScheme::rank_based}) {
    ResamplingOptions options;
    options.scheme = outer;
    options.inner_scheme = GetParam();
    Resampler resampler(options);
    Statistics statistics(8);
    for (std::uint32_t trial = 0; trial < 20000; ++trial) {
      const ResamplingResult result =
          resampler.resample(weights, 8, RandomStream(5, RandomPurpose::test, trial));
      for (int k = 0; k < 8; ++k) statistics.add(static_cast<std::size_t>(k), result.counts[k]);
      statistics.end_trial();
    }
    for (std::size_t k = 0; k < 8; ++k) {
      const double expected = outer == ResamplingScheme::partial
                                  ? expected_partial[k]
                                  : 1.5 - (1.5 - 0.5) * (ranks[k] - 1.0) / 7.0;
      EXPECT_NEAR(statistics.mean(k), expected, statistics.bound(k, 1.0) + 1e-13)
          << to_string(outer) << " particle " << k;
    }
  }
}

}  // namespace
}  // namespace pf_resampling
