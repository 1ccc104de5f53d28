#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "pf_resampling_core/strategy/resampling.hpp"
#include "pf_resampling_core/strategy/schemes/schemes.hpp"
#include "pf_resampling_core/test/strategy/weight_families.hpp"

/// Facts about each scheme: the papers' own examples and formulas, and their listings, corrected
/// where they would lose or gain particles, transcribed naively in long double.
namespace pf_resampling {

DrawCounts rank_based;  // to look at its probabilities

namespace {

using Scheme = ResamplingScheme;

RandomStream scheme_stream(std::uint32_t step) {
  return RandomStream(11, RandomPurpose::test, step);
}

Resampler make_resampler(Scheme scheme) {
  ResamplingOptions options;
  options.scheme = scheme;
  return Resampler(options);
}

Eigen::ArrayXi draw(const Eigen::ArrayXd& weights, int size, double uniform) {
  std::vector<double> rescaled;
  Eigen::ArrayXi counts(weights.size());
  systematic(scale_weights(weights.data(), weights.size(), size, &rescaled), uniform,
             counts.data());
  return counts;
}

// Kwak Table I, with thresholds u + k/M.
Eigen::ArrayXi systematic_listing(const Eigen::ArrayXd& w, int size, double uniform) {
  Eigen::ArrayXi replicated(w.size());
  const long double total = w.cast<long double>().sum();
  long double s = 0.0L;
  int k = 0;
  for (Eigen::Index i = 0; i < w.size(); ++i) {
    s += w[i] / total;
    replicated[i] = 0;
    while (k < size && s > (static_cast<long double>(uniform) + k) / size) {
      ++replicated[i];
      ++k;
    }
  }
  return replicated;
}

// Kwak Table II, the bracket as floor.
Eigen::ArrayXi residual_systematic_listing(const Eigen::ArrayXd& w, int size, double uniform) {
  Eigen::ArrayXi replicated(w.size());
  const long double total = w.cast<long double>().sum();
  long double delta = static_cast<long double>(uniform) / size;
  for (Eigen::Index k = 0; k < w.size(); ++k) {
    const long double weight = w[k] / total;
    replicated[k] = static_cast<int>(std::floor((weight - delta) * size)) + 1;
    delta += static_cast<long double>(replicated[k]) / size - weight;
  }
  return replicated;
}

// Mahmoud section II.D with the floor and the last line put right.
Eigen::ArrayXi residual_then_systematic_listing(const Eigen::ArrayXd& w, int size, double uniform) {
  Eigen::ArrayXi r(w.size());
  Eigen::ArrayXd left_over(w.size());
  const long double total = w.cast<long double>().sum();
  for (Eigen::Index m = 0; m < w.size(); ++m) {
    const long double copies = w[m] / total * size;
    r[m] = static_cast<int>(std::floor(copies));
    left_over[m] = static_cast<double>(copies - r[m]);
  }
  const int still = size - r.sum();
  if (still > 0) r += systematic_listing(left_over, still, uniform);
  return r;
}

// Mahmoud section II.E with the count stored where it belongs.
Eigen::ArrayXi stratified_listing(const Eigen::ArrayXd& w, int size, const RandomStream& stream) {
  Eigen::ArrayXi r = Eigen::ArrayXi::Zero(w.size());
  const long double total = w.cast<long double>().sum();
  Eigen::Index j = 0;
  long double s = w[0] / total;
  for (int m = 0; m < size; ++m) {
    const long double threshold =
        (stream.uniform(static_cast<std::uint64_t>(m)) + static_cast<long double>(m)) / size;
    while (s < threshold && j + 1 < w.size()) s += w[++j] / total;
    ++r[j];
  }
  return r;
}

Eigen::ArrayXd random_weights(std::uint32_t trial, int size) {
  Eigen::ArrayXd weights(size);
  RandomStream(12, RandomPurpose::test, trial).fill_uniform(0, size, weights.data());
  weights = weights.pow(1 + static_cast<int>(trial % 4));
  return weights / weights.sum();
}

// Kwak section 3.1: weights and offset, and its result {1, 2, 2, 4, 5, 6}. U = 0.06 = uniform / 6.
TEST(Systematic, GivesTheWorkedExampleOfK) {
  Eigen::ArrayXd weights(6);
  weights << 0.2, 0.29, 0.04, 0.13, 0.2, 0.14;
  Eigen::ArrayXi expected(6);
  expected << 1, 2, 0, 1, 1, 1;
  EXPECT_TRUE((draw(weights, 6, 6 * 0.06) == expected).all());
}

// The uniform is the first of the stream.
TEST(Systematic, TakesItsOffsetFromTheStream) {
  Resampler resampler = make_resampler(Scheme::systematic);
  for (std::uint32_t trial = 0; trial < 1000; ++trial) {
    const Eigen::ArrayXd weights = random_weights(trial, 10);
    ASSERT_TRUE((resampler.resample(weights, 10, scheme_stream(trial)).counts ==
                 systematic_listing(weights, 10, scheme_stream(trial).uniform(0)))
                    .all());
  }
}

// The three listings, for one uniform. That a threshold falls within the rounding error of a
// running sum, where they may differ, has a probability below 1e-9 in all the trials together.
TEST(Systematic, IsWhatAllThreeListingsSay) {
  for (std::uint32_t trial = 0; trial < 200000; ++trial) {
    const RandomStream stream = scheme_stream(trial);
    const int inputs = 1 + static_cast<int>(stream.uniform(1) * 12);
    const int size = 1 + static_cast<int>(stream.uniform(2) * 12);
    const Eigen::ArrayXd weights = random_weights(trial, inputs);
    const double uniform = stream.uniform(0);
    const Eigen::ArrayXi counts = draw(weights, size, uniform);
    ASSERT_TRUE((systematic_listing(weights, size, uniform) == counts).all());
    ASSERT_TRUE((residual_systematic_listing(weights, size, uniform) == counts).all());
    ASSERT_TRUE((residual_then_systematic_listing(weights, size, uniform) == counts).all());
  }
}

TEST(Stratified, IsTheListingOfMPutRight) {
  Resampler resampler = make_resampler(Scheme::stratified);
  for (std::uint32_t trial = 0; trial < 50000; ++trial) {
    const int inputs = 1 + static_cast<int>(trial % 13);
    const int size = 1 + static_cast<int>(trial % 17);
    const Eigen::ArrayXd weights = random_weights(trial, inputs);
    ASSERT_TRUE((resampler.resample(weights, size, scheme_stream(trial)).counts ==
                 stratified_listing(weights, size, scheme_stream(trial)))
                    .all());
  }
  const Eigen::ArrayXd weights = make_weights(Weights::random, 100000);
  EXPECT_TRUE((resampler.resample(weights, 100000, scheme_stream(1)).counts ==
               stratified_listing(weights, 100000, scheme_stream(1)))
                  .all());
}

// How far counts may lie below floor(M w) and above ceil(M w).
struct Slack {
  Scheme scheme;
  int below, above;
};
class FloorOrCeil : public testing::TestWithParam<Slack> {};
INSTANTIATE_TEST_SUITE_P(All, FloorOrCeil,
                         testing::Values(Slack{Scheme::systematic, 0, 0}, Slack{Scheme::ssp, 0, 0},
                                         Slack{Scheme::residual, 0, 29},
                                         Slack{Scheme::stratified, 1, 1}));

TEST_P(FloorOrCeil, Holds) {
  Resampler resampler = make_resampler(GetParam().scheme);
  for (std::uint32_t trial = 0; trial < 20000; ++trial) {
    const int inputs = 1 + static_cast<int>(trial % 31);
    const int size = 1 + static_cast<int>(trial % 29);
    const Eigen::ArrayXd weights = random_weights(trial, inputs);
    const ResamplingResult result = resampler.resample(weights, size, scheme_stream(trial));
    for (int k = 0; k < inputs; ++k) {
      const double copies = weights[k] * size;
      ASSERT_GE(result.counts[k], std::floor(copies - 1e-12) - GetParam().below);
      ASSERT_LE(result.counts[k], std::ceil(copies + 1e-12) + GetParam().above);
    }
  }
}

// ---- Variances --------------------------------------------------------------------------------

// Variance of each count: Mahmoud section II.A, B, C and E; stratified as the sum over the strata
// that a particle's part touches, which is Mahmoud's formula where the left-over lies in one.
Eigen::ArrayXd expected_variances(Scheme scheme, const Eigen::ArrayXd& weights, int size) {
  const Eigen::ArrayXd copies = weights * size;
  const Eigen::ArrayXd left_over = copies - copies.floor();
  switch (scheme) {
    case Scheme::multinomial:
      return copies * (1.0 - weights);
    case Scheme::residual: {
      const double draws = size - copies.floor().sum();
      const Eigen::ArrayXd probability = left_over / draws;
      return draws * probability * (1.0 - probability);
    }
    case Scheme::stratified: {
      Eigen::ArrayXd variances = Eigen::ArrayXd::Zero(weights.size());
      double begin = 0.0;
      for (Eigen::Index k = 0; k < weights.size(); ++k) {
        const double end = begin + copies[k];
        for (int stratum = 0; stratum < size; ++stratum) {
          const double inside =
              std::max(0.0, std::min(end, stratum + 1.0) - std::max(begin, double{1} * stratum));
          variances[k] += inside * (1.0 - inside);
        }
        begin = end;
      }
      return variances;
    }
    default:  // floor or ceil, with the mean M w
      return left_over * (1.0 - left_over);
  }
}

class Variance : public testing::TestWithParam<Scheme> {};
INSTANTIATE_TEST_SUITE_P(All, Variance,
                         testing::Values(Scheme::multinomial, Scheme::residual, Scheme::systematic,
                                         Scheme::stratified, Scheme::ssp));

// 30000 trials: the mean of (count - M w)^2 within six of its standard errors (a false alarm: 2e-9
// each, 140 of them).
TEST_P(Variance, IsThatOfThePaper) {
  constexpr int kTrials = 30000;
  Resampler resampler = make_resampler(GetParam());
  for (const Weights family : {Weights::random, Weights::skewed}) {
    const int size = 10;
    const Eigen::ArrayXd weights = make_weights(family, size);
    const Eigen::ArrayXd expected = expected_variances(GetParam(), weights, size);
    Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(size);
    Eigen::ArrayXd sum_of_squares = Eigen::ArrayXd::Zero(size);
    for (std::uint32_t trial = 0; trial < kTrials; ++trial) {
      const Eigen::ArrayXd square =
          (resampler.resample(weights, size, scheme_stream(trial)).counts.cast<double>() -
           weights * size)
              .square();
      sum += square;
      sum_of_squares += square.square();
    }
    const Eigen::ArrayXd mean = sum / kTrials;
    const Eigen::ArrayXd error = ((sum_of_squares / kTrials - mean.square()) / kTrials).sqrt();
    for (int k = 0; k < size; ++k) {
      EXPECT_NEAR(mean[k], expected[k], 6.0 * error[k] + 1e-3) << "particle " << k;
    }
  }
}

// ---- Multinomial ------------------------------------------------------------------------------

// Chi-square with 3 degrees of freedom above 31 has a probability of 8e-7.
void expect_probabilities(const Eigen::Array4d& observed, const Eigen::Array4d& probabilities) {
  const Eigen::Array4d expected = observed.sum() * probabilities;
  EXPECT_LT(((observed - expected).square() / expected).sum(), 31.0);
}

// M independent draws: the counts of two particles have covariance -M w_i w_j, and the probability
// of each outcome of three draws from two particles is binomial.
TEST(Multinomial, HasTheProbabilitiesOfIndependentDraws) {
  Eigen::ArrayXd weights(2);
  weights << 0.3, 0.7;
  Resampler resampler = make_resampler(Scheme::multinomial);
  constexpr int kTrials = 50000;
  Eigen::Array4d observed = Eigen::Array4d::Zero();
  for (std::uint32_t trial = 0; trial < kTrials; ++trial) {
    observed[resampler.resample(weights, 3, scheme_stream(trial)).counts[0]] += 1.0;
  }
  expect_probabilities(observed, {0.343, 0.441, 0.189, 0.027});
}

// ---- SSP and killing --------------------------------------------------------------------------

// Four weights of 1/4 and two copies: the first pair settles one copy and the second pair the
// other, each particle with probability 1/2; systematic knows two of these four outcomes only.
// 50000 trials.
TEST(Ssp, SettlesPairByPair) {
  Resampler resampler = make_resampler(Scheme::ssp);
  const Eigen::ArrayXd weights = Eigen::ArrayXd::Constant(4, 0.25);
  constexpr int kTrials = 50000;
  Eigen::Array4d observed = Eigen::Array4d::Zero();
  for (std::uint32_t trial = 0; trial < kTrials; ++trial) {
    const ResamplingResult result = resampler.resample(weights, 2, scheme_stream(trial));
    ASSERT_EQ(result.counts[0] + result.counts[1], 1);
    ASSERT_EQ(result.counts[2] + result.counts[3], 1);
    observed[2 * result.counts[0] + result.counts[2]] += 1.0;
  }
  expect_probabilities(observed, Eigen::Array4d::Constant(0.25));
}

// Negative association: no two counts are positively correlated, for any order of the particles. In
// systematic resampling the first and third of these weights always go together. 20000 trials; the
// tolerance is six standard errors of a product of numbers within 1 (0.25 / sqrt(trials) each).
TEST(Ssp, HasNoPositiveCovariances) {
  const Eigen::ArrayXd weights = Eigen::ArrayXd::Constant(8, 1.0 / 8);
  Resampler ssp_resampler = make_resampler(Scheme::ssp);
  Resampler systematic_resampler = make_resampler(Scheme::systematic);
  constexpr int kTrials = 20000;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(8, 8);
  double systematic_covariance = 0.0;
  for (std::uint32_t trial = 0; trial < kTrials; ++trial) {
    const Eigen::VectorXd difference =
        ssp_resampler.resample(weights, 4, scheme_stream(trial)).counts.cast<double>() - 0.5;
    covariance += difference * difference.transpose() / kTrials;
    const Eigen::Array<double, 8, 1> other =
        systematic_resampler.resample(weights, 4, scheme_stream(trial)).counts.cast<double>() - 0.5;
    systematic_covariance += other[0] * other[2] / kTrials;
  }
  for (int i = 0; i < 8; ++i) {
    for (int j = 0; j < i; ++j) EXPECT_LT(covariance(i, j), 6.0 * 0.25 / std::sqrt(kTrials));
  }
  EXPECT_GT(systematic_covariance, 0.2);  // the test can tell
}

// The best particle always lives; each other with probability w / max w, at least. 20000 trials.
TEST(Killing, LetsParticlesLiveByTheirWeightOverTheLargest) {
  Eigen::ArrayXd weights(4);
  weights << 0.1, 0.4, 0.2, 0.3;
  Resampler resampler = make_resampler(Scheme::killing);
  constexpr int kTrials = 20000;
  Eigen::ArrayXd alive = Eigen::ArrayXd::Zero(4);
  for (std::uint32_t trial = 0; trial < kTrials; ++trial) {
    const ResamplingResult result = resampler.resample(weights, 4, scheme_stream(trial));
    ASSERT_GE(result.counts[1], 1);
    alive += (result.counts > 0).cast<double>() / kTrials;
  }
  // P(alive) = 1 - P(killed and never drawn in place of the others killed). By hand for the first:
  // it is killed with probability 3/4; of the third (1/2) and fourth (1/4), others may be, too.
  // E[0.9^(1 + killed others)] = 0.9 (0.5 + 0.5 * 0.9) (0.75 + 0.25 * 0.9).
  const double expected = 1.0 - 0.75 * 0.9 * (0.5 + 0.5 * 0.9) * (0.75 + 0.25 * 0.9);
  EXPECT_NEAR(alive[0], expected, 6.0 * std::sqrt(expected * (1.0 - expected) / kTrials));
}

// ---- Partial ----------------------------------------------------------------------------------

TEST(Partial, LeavesTheModerateAndSharesTheMassOfTheOthers) {
  // Mean 1/8: above 0.25 and below 0.0625 take part.
  Eigen::ArrayXd weights(8);
  weights << 0.02, 0.3, 0.15, 0.05, 0.14, 0.1, 0.2, 0.04;
  const double share = (0.02 + 0.3 + 0.05 + 0.04) / 4.0;
  Resampler resampler = make_resampler(Scheme::partial);
  for (std::uint32_t trial = 0; trial < 100; ++trial) {
    const ResamplingResult result = resampler.resample(weights, 8, scheme_stream(trial));
    for (const int moderate : {2, 4, 5, 6}) {
      ASSERT_EQ(result.counts[moderate], 1);
      ASSERT_EQ(result.ancestors[moderate], moderate);
      ASSERT_NEAR(result.log_weights[moderate], std::log(weights[moderate]), 1e-14);
    }
    ASSERT_GE(result.counts[1], 2);  // floor(4 * 0.3 / 0.41)
    for (const int slot : {0, 1, 3, 7}) {
      ASSERT_NEAR(result.log_weights[slot], std::log(share), 1e-14);
    }
  }
}

TEST(Partial, ResetsTheWeightsWhenToldTo) {
  ResamplingOptions options;
  options.scheme = Scheme::partial;
  options.weights_after = WeightsAfter::reset;
  Resampler resampler(options);
  const ResamplingResult result =
      resampler.resample(make_weights(Weights::skewed, 50), 50, scheme_stream(1));
  EXPECT_TRUE((result.log_weights + std::log(50.0)).abs().maxCoeff() < 1e-14);
}

TEST(Partial, ThresholdsAreStrictAndSelectable) {
  // Weights of exactly 2/4 and 0.5/4 are moderate by the defaults.
  Eigen::ArrayXd weights(4);
  weights << 0.5, 0.125, 0.125, 0.25;
  ResamplingOptions options;
  options.scheme = Scheme::partial;
  EXPECT_TRUE((Resampler(options).resample(weights, 4, scheme_stream(1)).counts == 1).all());
  options.partial_high = 1.9;
  Resampler resampler(options);
  // Now the first takes part, alone: it gets its own slot back.
  EXPECT_TRUE((resampler.resample(weights, 4, scheme_stream(1)).counts == 1).all());
  options.partial_low = 0.6;
  Resampler both(options);
  // 0.5 and twice 0.125 share three slots: two copies of the first at the least.
  for (std::uint32_t trial = 0; trial < 50; ++trial) {
    ASSERT_GE(both.resample(weights, 4, scheme_stream(trial)).counts[0], 2);
  }
}

// One that takes part alone, with the smallest weight there is: it keeps just that.
TEST(Partial, SharesMassesOfAnySize) {
  const double tiny = std::numeric_limits<double>::denorm_min();
  Eigen::ArrayXd weights(4);
  weights << 0.25, 0.25, 0.5, tiny;
  Resampler resampler = make_resampler(Scheme::partial);
  const ResamplingResult result = resampler.resample(weights, 4, scheme_stream(1));
  EXPECT_TRUE((result.counts == 1).all());
  EXPECT_NEAR(result.log_weights[3], -1074.0 * std::log(2.0), 1e-12);
  EXPECT_NEAR(result.log_weights[2], std::log(0.5), 1e-15);
}

// Two particles at the upper threshold and two impossible ones: nobody could fill the slots of the
// latter if only they took part.
TEST(Partial, LetsEverybodyTakePartWhenOnlyTheImpossibleWould) {
  Eigen::ArrayXd weights(4);
  weights << 0.0, 0.5, 0.5, 0.0;
  Eigen::ArrayXi expected(4);
  expected << 0, 2, 2, 0;
  Resampler resampler = make_resampler(Scheme::partial);
  const ResamplingResult result = resampler.resample(weights, 4, scheme_stream(1));
  EXPECT_TRUE((result.counts == expected).all());
  EXPECT_NEAR(result.log_weights.exp().sum(), 1.0, 1e-14);
}

// ---- Rank-based -------------------------------------------------------------------------------

// Kwak eq. 3 with eta_max = 1.5 on the weights of Kwak section 3.1, two of which tie for ranks 2
// and 3. Systematic inside: counts are floor or ceil of M p, here 0 or 1 and 1 or 2.
TEST(RankBased, GivesTheProbabilitiesOfEquationThree) {
  Eigen::ArrayXd weights(6);
  weights << 0.2, 0.29, 0.04, 0.13, 0.2, 0.14;
  const double ranks[] = {2.5, 1.0, 6.0, 5.0, 2.5, 4.0};
  std::vector<double> rescaled;
  ResamplingWorkspace work;
  ResamplingOptions options;
  Eigen::ArrayXi counts(6);
  for (const double rank_max : {1.0, 1.25, 1.5, 2.0}) {
    options.rank_max = rank_max;
    rank_based(scale_weights(weights.data(), 6, 6, &rescaled), options, scheme_stream(1), &work,
               counts.data());
    for (std::size_t k = 0; k < 6; ++k) {
      const double expected =
          (rank_max - (rank_max - (2.0 - rank_max)) * (ranks[k] - 1.0) / 5.0) / 6.0;
      EXPECT_NEAR(work.inner_weights.at(k), expected, 1e-15);
    }
  }
}

// Against ranks found by std::sort, for weights that share many digits, differ in the last one, or
// tie.
TEST(RankBased, RanksAsSortingDoes) {
  for (std::uint32_t trial = 0; trial < 60; ++trial) {
    const int size = trial < 50 ? 1 + static_cast<int>(trial * 7) : 5000;
    Eigen::ArrayXd weights(size);
    RandomStream(13, RandomPurpose::test, trial).fill_uniform(0, size, weights.data());
    if (trial % 5 == 1) weights = 1.0 + (weights * 4.0).floor() * 0x1p-52;
    if (trial % 5 == 2) weights = (weights * 1e-300) * 1e-15;
    if (trial % 5 == 3) weights = (weights * 700.0 - 350.0).exp();
    if (trial % 5 == 4) weights = (weights < 0.5).select(0.0, weights);
    if (weights.sum() == 0.0) weights[0] = 1.0;
    std::vector<double> positive;
    for (const double weight : weights) {
      if (weight > 0.0) positive.push_back(weight);
    }
    std::sort(positive.begin(), positive.end(), std::greater<double>());
    const double n = static_cast<double>(positive.size());

    std::vector<double> rescaled;
    ResamplingWorkspace work;
    ResamplingOptions options;
    Eigen::ArrayXi counts(size);
    const ScaledWeights scaled = scale_weights(weights.data(), size, size, &rescaled);
    if (scaled.weights != weights.data()) continue;  // brought into range: others may be lost
    rank_based(scaled, options, scheme_stream(1), &work, counts.data());
    for (int k = 0; k < size; ++k) {
      double expected = 0.0;
      if (weights[k] > 0.0) {
        const auto range =
            std::equal_range(positive.begin(), positive.end(), weights[k], std::greater<double>());
        const double before = static_cast<double>(range.first - positive.begin());
        const double through = static_cast<double>(range.second - positive.begin());
        const double rank = 0.5 * (before + 1.0 + through);
        expected = n > 1 ? (1.5 - (rank - 1.0) / (n - 1.0)) / n : 1.0;
      }
      ASSERT_NEAR(work.inner_weights.at(static_cast<std::size_t>(k)), expected, 1e-15)
          << trial << " " << k;
    }
  }
}

TEST(RankBased, LeavesWeightsOverProbabilities) {
  Eigen::ArrayXd weights(4);
  weights << 0.1, 0.4, 0.2, 0.3;
  // Ranks 4, 1, 3, 2; p by eq. 3 with eta_max 1.5: (1.5 - (rank - 1) / 3) / 4.
  const double p[] = {0.5 / 4, 1.5 / 4, (1.5 - 2.0 / 3) / 4, (1.5 - 1.0 / 3) / 4};
  Resampler resampler = make_resampler(Scheme::rank_based);
  for (std::uint32_t trial = 0; trial < 100; ++trial) {
    const ResamplingResult result = resampler.resample(weights, 5, scheme_stream(trial));
    double sum = 0.0;
    for (const int k : result.ancestors) sum += weights[k] / p[k];
    for (int slot = 0; slot < 5; ++slot) {
      const int k = result.ancestors[slot];
      ASSERT_NEAR(result.log_weights[slot], std::log(weights[k] / p[k] / sum), 1e-14);
    }
  }
}

}  // namespace
}  // namespace pf_resampling
