#include "pf_resampling_core/strategy/compensation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {
namespace {

// What a chi-square variable of 4 degrees of freedom exceeds once in a million:
// exp(-x/2) (1 + x/2) = 1e-6.
constexpr double kChiSquare4 = 33.377;

RandomStream compensation_stream(std::uint32_t step) {
  return RandomStream(11, RandomPurpose::test, step);
}

Eigen::ArrayXd array(std::initializer_list<double> values) {
  Eigen::ArrayXd result(static_cast<Eigen::Index>(values.size()));
  Eigen::Index i = 0;
  for (const double value : values) result[i++] = value;
  return result;
}

CompensationResult compensate_with(Pairing pairing, ConstArray weights, double ratio = 1.0,
                                   std::uint32_t step = 0) {
  CompensationOptions options;
  options.pairing = pairing;
  options.ratio = ratio;
  return compensate(options, weights, compensation_stream(step));
}

void expect_pair(const BlendPair& pair, int low, int high, double share) {
  EXPECT_EQ(pair.low, low);
  EXPECT_EQ(pair.high, high);
  EXPECT_NEAR(pair.share, share, 1e-12);
}

// Ascending by weight, ties by slot: the worst with the best. Of an odd number the median is
// strong; two that are impossible share equally; shares hold for the smallest weights there are.
TEST(Compensation, RankPairsTheWorstWithTheBest) {
  const std::pair<Eigen::ArrayXd, std::vector<BlendPair>> cases[] = {
      {array({0.1, 0.05, 0.25, 0.3, 0.15, 0.15}),
       {{1, 3, 0.05 / 0.35}, {0, 2, 0.1 / 0.35}, {4, 5, 0.5}}},
      {Eigen::ArrayXd::Constant(6, 1.0 / 6), {{0, 5, 0.5}, {1, 4, 0.5}, {2, 3, 0.5}}},
      {array({0.2, 0.1, 0.3, 0.15, 0.25}), {{1, 2, 0.25}, {3, 4, 0.15 / 0.4}}},
      {array({0.0, 1.0, 0.0, 0.0}), {{0, 1, 0.0}, {2, 3, 0.5}}},
      {array({3e-310, 1e-310}), {{1, 0, 0.25}}}};
  for (const auto& [weights, expected] : cases) {
    SCOPED_TRACE(weights.transpose());
    const auto pairs = compensate_with(Pairing::rank, weights).pairs;
    ASSERT_EQ(pairs.size(), expected.size());
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      expect_pair(pairs[i], expected[i].low, expected[i].high, expected[i].share);
    }
  }
}

TEST(Compensation, OneParticleHasNoPartnerAndTwoAreAPair) {
  for (const Pairing pairing : all_values<Pairing>()) {
    const auto alone = compensate_with(pairing, array({1.0}));
    EXPECT_TRUE(alone.pairs.empty());
    EXPECT_TRUE((alone.log_weights == 0.0).all());
    const auto both = compensate_with(pairing, array({0.75, 0.25}));
    ASSERT_EQ(both.pairs.size(), 1u);
    expect_pair(both.pairs[0], 1, 0, 0.25);
  }
}

TEST(Compensation, TheMedianOfAnOddNumberIsStrong) {
  const Eigen::ArrayXd weights = array({0.2, 0.1, 0.3, 0.15, 0.25});
  std::set<int> highs;
  for (std::uint32_t step = 0; step < 200; ++step) {
    for (const auto& pair : compensate_with(Pairing::random, weights, 1.0, step).pairs) {
      highs.insert(pair.high);
    }
  }
  // Missing one of the three in 400 draws: 3 (2/3)^400.
  EXPECT_EQ(highs, (std::set<int>{0, 2, 4}));
}

TEST(Compensation, TheRatioIsOfTheWeakHalfWorstFirst) {
  Eigen::ArrayXd weights(100);
  for (int i = 0; i < 100; ++i) weights[i] = (100.0 - i) / 5050.0;
  for (const Pairing pairing : all_values<Pairing>()) {
    // Kwak Table VI, then rounding to the nearest, at least one.
    for (const auto& [ratio, count] : std::vector<std::pair<double, std::size_t>>{{0.1, 5},
                                                                                  {0.2, 10},
                                                                                  {0.5, 25},
                                                                                  {1.0, 50},
                                                                                  {0.029, 1},
                                                                                  {0.031, 2},
                                                                                  {1e-9, 1},
                                                                                  {0.989, 49},
                                                                                  {0.991, 50}}) {
      const auto result = compensate_with(pairing, weights, ratio);
      ASSERT_EQ(result.pairs.size(), count) << ratio;
      for (std::size_t i = 0; i < count; ++i) {
        EXPECT_EQ(result.pairs[i].low, 99 - static_cast<int>(i));
        EXPECT_LT(result.pairs[i].high, 50);
      }
    }
  }
}

// The control: what resetting the weights does by itself.
TEST(Compensation, AtARatioOfZeroTheWeightsAloneChange) {
  for (const Pairing pairing : all_values<Pairing>()) {
    const auto result = compensate_with(pairing, array({0.4, 0.3, 0.2, 0.1}), 0.0);
    EXPECT_TRUE(result.pairs.empty());
    EXPECT_TRUE((result.log_weights == -std::log(4.0)).all());
  }
}

TEST(Compensation, RandomTakesEachStrongOneAlikeAndRouletteByWeight) {
  const Eigen::ArrayXd weights = array({.02, .3, .04, .1, .06, .11, .08, .12, .07, .1});
  const double strong_weight = .3 + .1 + .11 + .12 + .1;
  constexpr int kSteps = 20000;
  for (const Pairing pairing : {Pairing::random, Pairing::roulette}) {
    Eigen::ArrayXd hits = Eigen::ArrayXd::Zero(10);
    for (std::uint32_t step = 0; step < kSteps; ++step) {
      for (const auto& pair : compensate_with(pairing, weights, 1.0, step).pairs) {
        hits[pair.high] += 1.0;
        EXPECT_DOUBLE_EQ(pair.share, weights[pair.low] / (weights[pair.low] + weights[pair.high]));
      }
    }
    double chi_square = 0.0;
    for (const int slot : {1, 3, 5, 7, 9}) {
      const double probability =
          pairing == Pairing::random ? 1.0 / 5.0 : weights[slot] / strong_weight;
      const double expected = 5.0 * kSteps * probability;
      chi_square += (hits[slot] - expected) * (hits[slot] - expected) / expected;
    }
    EXPECT_EQ(hits.sum(), 5.0 * kSteps);
    EXPECT_LT(chi_square, kChiSquare4);  // false alarm 1e-6
  }
}

TEST(Compensation, DrawsOfDifferentWeakOnesAreIndependent) {
  // Both weak ones choose among two strong ones of equal weight: four outcomes of equal
  // probability.
  constexpr int kSteps = 20000;
  const Eigen::ArrayXd weights = array({0.1, 0.2, 0.35, 0.35});
  for (const Pairing pairing : {Pairing::random, Pairing::roulette}) {
    Eigen::ArrayXd outcomes = Eigen::ArrayXd::Zero(4);
    for (std::uint32_t step = 0; step < kSteps; ++step) {
      const auto pairs = compensate_with(pairing, weights, 1.0, step).pairs;
      outcomes[2 * (pairs[0].high - 2) + (pairs[1].high - 2)] += 1.0;
    }
    const double expected = kSteps / 4.0;
    // Three degrees of freedom, held against the quantile of four: false alarm below 1e-6.
    EXPECT_LT((outcomes - expected).square().sum() / expected, kChiSquare4);
  }
}

TEST(Compensation, RouletteNeverTakesAnImpossibleParticle) {
  for (std::uint32_t step = 0; step < 1000; ++step) {
    const auto result =
        compensate_with(Pairing::roulette, array({0.0, 0.6, 0.0, 0.0, 0.4, 0.0, 0.0}), 1.0, step);
    ASSERT_EQ(result.pairs.size(), 3u);
    for (const auto& pair : result.pairs) {
      EXPECT_TRUE(pair.high == 1 || pair.high == 4);
      EXPECT_EQ(pair.share, 0.0);
    }
  }
}

// Kwak eqs. 7 and 8 with the weights as they are: 0.1 of the weak and 0.4 of the strong pose.
TEST(Compensation, LiteralPairsGoTowardsTheOrigin) {
  CompensationOptions options;
  options.blend = Blend::literal;
  const auto result =
      compensate(options, 2.0 * array({0.1, 0.2, 0.3, 0.4}), compensation_stream(0));
  ASSERT_EQ(result.pairs.size(), 2u);
  expect_pair(result.pairs[0], 0, 3, 0.1);
  EXPECT_DOUBLE_EQ(result.pairs[0].total, 0.5);
  Eigen::ArrayXd x = array({10.0, 20.0, 30.0, 40.0}), y = -x, heading = array({0.1, 0.2, 0.3, 0.4});
  blend_poses(result.pairs, x, y, heading);
  EXPECT_TRUE(x.isApprox(array({17.0, 13.0, 30.0, 40.0}), 1e-15));
  EXPECT_TRUE(y.isApprox(-x));
  EXPECT_TRUE(heading.isApprox(array({0.17, 0.13, 0.3, 0.4}), 1e-14));
}

// By hand: (1, 2) and (5, 0) with shares 1/4 and 3/4 are (4, 0.5), and 3/16 of (4, -2) squared is
// between them.
TEST(Compensation, CovariancesAreKeptOrMatchTheMomentsOfBoth) {
  const std::vector<BlendPair> pairs = {{0, 1, 0.25}};
  const Eigen::ArrayXd x = array({1.0, 5.0}), y = array({2.0, 0.0});
  Eigen::ArrayXd xx = array({0.4, 0.8}), xy = array({0.1, -0.1}), means = x;
  blend_covariances(pairs, CovarianceTreatment::keep, x, x, xx);
  EXPECT_TRUE((xx == array({0.4, 0.8})).all());
  blend_covariances(pairs, CovarianceTreatment::moment_matched, x, x, xx);
  blend_covariances(pairs, CovarianceTreatment::moment_matched, x, y, xy);
  EXPECT_TRUE(xx.isApprox(array({0.7 + 3.0, 0.8}), 1e-15));
  EXPECT_TRUE(xy.isApprox(array({-0.05 - 1.5, -0.1}), 1e-15));
  blend_means(pairs, means);
  EXPECT_TRUE((means == array({4.0, 5.0})).all());
}

TEST(Compensation, PairMeanKeepsTheWeightOfEachPair) {
  CompensationOptions options;
  options.weights_after = CompensatedWeights::pair_mean;
  const Eigen::ArrayXd weights = array({0.05, 0.5, 0.12, 0.3, 0.03});
  const auto all = compensate(options, weights, compensation_stream(0));
  EXPECT_TRUE(all.log_weights.exp().isApprox(array({0.175, 0.265, 0.12, 0.175, 0.265}), 1e-14));
  options.ratio = 0.5;
  const auto half = compensate(options, 2.0 * weights, compensation_stream(0));
  EXPECT_TRUE(half.log_weights.exp().isApprox(array({0.05, 0.265, 0.12, 0.3, 0.265}), 1e-14));
}

TEST(Compensation, PairMeanIsOfAllThatShareAStrongParticle) {
  CompensationOptions options;
  options.pairing = Pairing::roulette;
  options.weights_after = CompensatedWeights::pair_mean;
  const auto result = compensate(options, array({0.0, 0.0, 0.0, 1.0}), compensation_stream(0));
  EXPECT_EQ(result.log_weights[2], -std::numeric_limits<double>::infinity());
  for (const int slot : {0, 1, 3}) EXPECT_NEAR(result.log_weights[slot], -std::log(3.0), 1e-15);
}

TEST(Compensation, WeightsAreNormalizedAfterwards) {
  for (std::uint32_t step = 0; step < 500; ++step) {
    Eigen::ArrayXd weights(1 + step % 40);
    compensation_stream(step).fill_uniform(0, weights.size(), weights.data());
    weights /= weights.sum();
    for (const Pairing pairing : all_values<Pairing>()) {
      for (const CompensatedWeights policy : all_values<CompensatedWeights>()) {
        CompensationOptions options;
        options.blend = step % 2 == 0 ? Blend::normalized : Blend::literal;
        options.pairing = pairing;
        options.ratio = 1.0 / (1 + step % 4);
        options.weights_after = policy;
        const auto result = compensate(options, weights, compensation_stream(step));
        ASSERT_NEAR(result.log_weights.exp().sum(), 1.0, 1e-13);
        ASSERT_NO_THROW(check_pairs(result.pairs, static_cast<int>(weights.size())));
        for (const auto& pair : result.pairs) {
          ASSERT_LE(pair.share, 0.5);
          ASSERT_GE(pair.share, 0.0);
        }
      }
    }
  }
}

TEST(Compensation, RefusesWhatIsNoDistribution) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const Eigen::ArrayXd& weights :
       {Eigen::ArrayXd(), array({0.0, 0.0}), array({0.5, -0.1}), array({0.5, nan}),
        array({infinity, 1.0}), array({1e308, 1e308})}) {
    EXPECT_THROW(compensate({}, weights, compensation_stream(0)), Error);
  }
  for (const double ratio : {-0.5, 1.0001, nan}) {
    EXPECT_THROW(compensate_with(Pairing::rank, array({0.4, 0.6}), ratio), Error) << ratio;
  }
}

TEST(CheckPairs, AcceptsAStrongParticleTwice) {
  EXPECT_NO_THROW(check_pairs({{0, 2, 0.5}, {1, 2, 0.0}}, 3));
  EXPECT_NO_THROW(check_pairs({}, 0));
}

TEST(CheckPairs, RefusesWhatDependsOnTheOrderOrIsOutOfRange) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<BlendPair> bad[] = {{{0, 2, 0.5}, {0, 1, 0.5}},  // a low twice
                                        {{0, 2, 0.5}, {2, 1, 0.5}},  // a high that is a low
                                        {{2, 1, 0.5}, {0, 2, 0.5}},  // a low that is a high
                                        {{1, 1, 0.5}},
                                        {{0, 3, 0.5}},
                                        {{3, 0, 0.5}},
                                        {{-1, 0, 0.5}},
                                        {{0, -1, 0.5}},
                                        {{0, 1, 0.0, -0.1}},
                                        {{0, 1, 0.0, 1.1}},
                                        {{0, 1, 0.0, nan}},
                                        {{0, 1, -0.1}},
                                        {{0, 1, 1.1}},
                                        {{0, 1, nan}}};
  for (const std::vector<BlendPair>& pairs : bad) {
    EXPECT_THROW(check_pairs(pairs, 3), Error) << pairs[0].low << " " << pairs[0].high;
  }
}

// Kwak eqs. 7 and 8 with the weights of the pair normalised: positions linearly, headings along the
// shorter arc; at the ends of the share one of the two is left.
TEST(BlendPoses, BlendsTheWeakWithTheStrong) {
  Eigen::ArrayXd x = array({1.0, 5.0, 9.0, 7.0, 3.0, 2.0});
  Eigen::ArrayXd y = array({-2.0, 2.0, 8.0, 7.0, 3.0, 4.0});
  Eigen::ArrayXd heading = array({kPi - 0.3, -kPi + 0.5, -0.2, 0.3, 0.4, -0.1});
  blend_poses({{0, 1, 0.25}, {2, 5, 0.0}, {3, 4, 1.0}}, x, y, heading);
  EXPECT_TRUE(x.isApprox(array({4.0, 5.0, 2.0, 7.0, 3.0, 2.0}), 1e-15));
  EXPECT_TRUE(y.isApprox(array({1.0, 2.0, 4.0, 7.0, 3.0, 4.0}), 1e-15));
  EXPECT_TRUE(heading.isApprox(array({-kPi + 0.3, -kPi + 0.5, -0.1, 0.3, 0.4, -0.1}), 1e-14));
}

TEST(BlendPoses, AnErrorChangesNothing) {
  Eigen::ArrayXd x = array({1.0, 5.0, 7.0});
  Eigen::ArrayXd y = x;
  Eigen::ArrayXd heading = x;
  EXPECT_THROW(blend_poses({{0, 1, 0.5}, {2, 3, 0.5}}, x, y, heading), Error);
  EXPECT_TRUE((x == array({1.0, 5.0, 7.0})).all());
  Eigen::ArrayXd short_heading = array({0.0});
  EXPECT_THROW(blend_poses({{0, 1, 0.5}}, x, y, short_heading), Error);
}

}  // namespace
}  // namespace pf_resampling
