#include "pf_resampling_core/resampling/resampling.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

RandomStream test_stream(std::uint32_t step) {
  return RandomStream(42, RandomPurpose::test, step);
}

std::string scheme_name(const testing::TestParamInfo<ResamplingScheme>& info) {
  return to_string(info.param);
}

class EveryScheme : public testing::TestWithParam<ResamplingScheme> {
 protected:
  EveryScheme() { options_.scheme = GetParam(); }

  bool keeps_the_number() const {
    return GetParam() == ResamplingScheme::partial || GetParam() == ResamplingScheme::killing;
  }

  ResamplingOptions options_;
};

INSTANTIATE_TEST_SUITE_P(All, EveryScheme, testing::ValuesIn(all_resampling_schemes()),
                         scheme_name);

TEST_P(EveryScheme, CountsSumToTheNumberAskedForAndAncestorsAgree) {
  Resampler resampler(options_);
  for (std::uint32_t step = 0; step < 2000; ++step) {
    const int inputs = 1 + static_cast<int>(step % 37);
    const int size = keeps_the_number() ? inputs : 1 + static_cast<int>((step / 37) % 41);
    Eigen::ArrayXd weights(inputs);
    RandomStream(7, RandomPurpose::test, step).fill_uniform(0, inputs, weights.data());
    weights = weights.pow(1.0 + step % 5);
    const ResamplingResult result = resampler.resample(weights, size, test_stream(step));
    ASSERT_EQ(result.counts.size(), inputs);
    ASSERT_EQ(result.ancestors.size(), size);
    ASSERT_EQ(result.counts.sum(), size);
    ASSERT_GE(result.counts.minCoeff(), 0);
    Eigen::ArrayXi counted = Eigen::ArrayXi::Zero(inputs);
    for (int slot = 0; slot < size; ++slot) ++counted[result.ancestors[slot]];
    ASSERT_TRUE((counted == result.counts).all());
    ASSERT_NEAR(result.log_weights.exp().sum(), 1.0, 1e-12);
  }
}

TEST_P(EveryScheme, TakesTheOneParticleThatHasWeight) {
  Resampler resampler(options_);
  for (const int inputs : {1, 2, 3, 100, 1000}) {
    for (const int hot : {0, inputs / 2, inputs - 1}) {
      for (std::uint32_t step = 0; step < 50; ++step) {
        Eigen::ArrayXd weights = Eigen::ArrayXd::Zero(inputs);
        weights[hot] = 1.0;
        const ResamplingResult result = resampler.resample(weights, inputs, test_stream(step));
        ASSERT_EQ(result.counts[hot], inputs);
        ASSERT_TRUE((result.ancestors == hot).all());
      }
    }
  }
}

}  // namespace
}  // namespace pf_resampling
