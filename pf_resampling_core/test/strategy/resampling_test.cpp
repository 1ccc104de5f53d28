#include "pf_resampling_core/strategy/resampling.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <new>
#include <stdexcept>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "pf_resampling_core/test/strategy/weight_families.hpp"

namespace {
std::int64_t allocations = 0;
}

// Counts what the tested library allocates, too.
__attribute__((noinline)) void* operator new(std::size_t size) {
  ++allocations;
  void* memory = std::malloc(size > 0 ? size : 1);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
__attribute__((noinline)) void operator delete(void* memory) noexcept {
  std::free(memory);
}
__attribute__((noinline)) void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

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

  // Other sizes than the number of weights, where the scheme can.
  std::vector<int> sizes(int inputs) const {
    if (keeps_size(options_)) return {inputs};
    return {inputs, 1, (inputs + 1) / 2, 2 * inputs + 1};
  }

  ResamplingOptions options_;
};

INSTANTIATE_TEST_SUITE_P(All, EveryScheme, testing::ValuesIn(all_values<ResamplingScheme>()),
                         scheme_name);

TEST_P(EveryScheme, IsSoundForAllWeightsAndSizes) {
  Resampler resampler(options_);
  for (const Weights family : all_weights()) {
    for (const int inputs : {1, 2, 3, 7, 8, 9, 63, 64, 65, 255, 256, 257, 1000}) {
      const Eigen::ArrayXd weights = make_weights(family, inputs);
      for (const int size : sizes(inputs)) {
        for (std::uint32_t step = 0; step < 20; ++step) {
          SCOPED_TRACE(to_string(family) + " " + std::to_string(inputs) + " to " +
                       std::to_string(size) + " step " + std::to_string(step));
          expect_sound(weights, size, resampler.resample(weights, size, test_stream(step)));
          if (HasFatalFailure()) return;
        }
      }
    }
  }
}

// A peer that adds 1/M again and again in single precision loses a particle here.
TEST_P(EveryScheme, IsSoundForAMillion) {
  Resampler resampler(options_);
  for (const int inputs : {100000, 999983, 1000000}) {
    for (const Weights family : all_weights()) {
      const Eigen::ArrayXd weights = make_weights(family, inputs);
      for (const int size : sizes(inputs)) {
        if (size != inputs && inputs != 100000) continue;
        SCOPED_TRACE(to_string(family) + " " + std::to_string(inputs) + " to " +
                     std::to_string(size));
        expect_sound(weights, size, resampler.resample(weights, size, test_stream(1)));
        if (HasFatalFailure()) return;
      }
    }
  }
}

// Only ratios count, down to sums of the smallest numbers there are and up to sums that overflow.
TEST_P(EveryScheme, DoesNotCareForTheScaleOfTheWeights) {
  Resampler resampler(options_);
  Resampler resampler_of_scaled(options_);
  const Eigen::ArrayXd weights = Eigen::ArrayXd::LinSpaced(64, 1.0, 64.0);
  for (const int exponent : {-1074, -1050, -1000, -600, -10, 10, 600, 1000, 1017}) {
    const Eigen::ArrayXd scaled =
        weights.unaryExpr([&](double weight) { return std::ldexp(weight, exponent); });
    const ResamplingResult expected = resampler.resample(weights, 64, test_stream(3));
    const ResamplingResult actual = resampler_of_scaled.resample(scaled, 64, test_stream(3));
    EXPECT_TRUE((actual.counts == expected.counts).all()) << "2^" << exponent;
    EXPECT_TRUE((actual.log_weights - expected.log_weights).abs().maxCoeff() < 1e-12)
        << "2^" << exponent;
  }
}

TEST_P(EveryScheme, GivesTheSameForTheSameStreamAndAnotherForAnother) {
  const Eigen::ArrayXd weights = make_weights(Weights::random, 500);
  Resampler first(options_);
  Resampler second(options_);
  second.resample(make_weights(Weights::skewed, 700), 700, test_stream(9));  // leaves no trace
  const ResamplingResult a = first.resample(weights, 500, test_stream(1));
  const ResamplingResult b = second.resample(weights, 500, test_stream(1));
  EXPECT_TRUE((a.ancestors == b.ancestors).all());
  EXPECT_TRUE((a.log_weights == b.log_weights).all());
  const Eigen::ArrayXi before = a.ancestors;
  EXPECT_FALSE((first.resample(weights, 500, test_stream(2)).ancestors == before).all());
}

TEST_P(EveryScheme, AllocatesNothingAfterTheFirstCallAtTheLargestSize) {
  Resampler resampler(options_);
  std::vector<Eigen::ArrayXd> all;
  for (const Weights family : all_weights()) {
    for (const int inputs : {5000, 1000, 17}) all.push_back(make_weights(family, inputs));
  }
  const Eigen::ArrayXd largest = make_weights(Weights::random, 5000);
  resampler.resample(largest, 5000, test_stream(0));
  const std::int64_t before = allocations;
  for (const Eigen::ArrayXd& weights : all) {
    for (std::uint32_t step = 1; step < 4; ++step) {
      resampler.resample(weights, static_cast<int>(weights.size()), test_stream(step));
    }
  }
  EXPECT_EQ(allocations - before, 0);
}

// Equal weights are left alone by every scheme whose counts are floor or ceil of M w, and by those
// for which every particle is as good as the best.
TEST_P(EveryScheme, KeepsEqualWeightsWhereItMust) {
  const ResamplingScheme scheme = GetParam();
  if (scheme == ResamplingScheme::multinomial) return;  // the one that does not
  Resampler resampler(options_);
  for (const int size : {1, 2, 3, 10, 100, 1000, 99991, 1000000}) {
    const Eigen::ArrayXd weights = Eigen::ArrayXd::Constant(size, 1.0 / size);
    for (std::uint32_t step = 0; step < (size > 10000 ? 2u : 50u); ++step) {
      const ResamplingResult result = resampler.resample(weights, size, test_stream(step));
      ASSERT_TRUE((result.counts == 1).all()) << size;
      ASSERT_TRUE((result.ancestors == Eigen::ArrayXi::LinSpaced(size, 0, size - 1)).all());
    }
  }
}

TEST_P(EveryScheme, RejectsWeightsItCannotUse) {
  Resampler resampler(options_);
  const int size = 300;
  const Eigen::ArrayXd good = make_weights(Weights::random, size);
  const double infinity = std::numeric_limits<double>::infinity();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {nan, -nan, infinity, -infinity, -1e-300, -0.1, -5e-324}) {
    for (const int place : {0, 1, 150, 255, 256, size - 1}) {
      Eigen::ArrayXd weights = good;
      weights[place] = bad;
      const std::string said = refusal([&] { resampler.resample(weights, size, test_stream(6)); });
      // The message names the place.
      EXPECT_TRUE(says(said, "weight " + std::to_string(place) + " "));
    }
  }
  EXPECT_THROW(resampler.resample(Eigen::ArrayXd(0), 3, test_stream(6)), Error);
  EXPECT_THROW(resampler.resample(Eigen::ArrayXd::Zero(size), size, test_stream(6)), Error);
  EXPECT_THROW(resampler.resample(Eigen::ArrayXd::Constant(size, nan), size, test_stream(6)),
               Error);
  EXPECT_THROW(resampler.resample(good, 0, test_stream(6)), Error);
  EXPECT_THROW(resampler.resample(good, -4, test_stream(6)), Error);
}

TEST_P(EveryScheme, TakesNegativeZeroForZero) {
  Resampler resampler(options_);
  Eigen::ArrayXd weights = make_weights(Weights::random, 10);
  weights[0] = -0.0;
  EXPECT_EQ(resampler.resample(weights, 10, test_stream(1)).counts[0], 0);
}

TEST(Resampling, ListsTheKnownNamesForAnUnknownOne) {
  const std::string message = refusal([&] { from_string<ResamplingScheme>("sytematic"); });
  EXPECT_TRUE(says(message, "sytematic"));
  for (const ResamplingScheme scheme : all_values<ResamplingScheme>()) {
    EXPECT_TRUE(says(message, to_string(scheme)));
  }
  EXPECT_THROW(to_string(static_cast<ResamplingScheme>(1000)), Error);
}

// Kwak section 3.2: as many are resampled as were weak or strong. Del Moral: only slots that fall
// free are filled. All others draw as many as they are asked for.
TEST(Resampling, KeepsTheSizeUnderPartialAndKilling) {
  const Eigen::ArrayXd weights = make_weights(Weights::random, 10);
  for (const ResamplingScheme scheme : all_values<ResamplingScheme>()) {
    for (const ResamplingScheme inner : inner_resampling_schemes()) {
      SCOPED_TRACE(to_string(scheme) + " with " + to_string(inner));
      ResamplingOptions options;
      options.scheme = scheme;
      options.inner_scheme = inner;
      const bool keeps =
          scheme == ResamplingScheme::partial || scheme == ResamplingScheme::killing ||
          (scheme == ResamplingScheme::rank_based && inner == ResamplingScheme::killing);
      EXPECT_EQ(keeps_size(options), keeps);
      Resampler resampler(options);
      EXPECT_EQ(resampler.resample(weights, 10, test_stream(1)).counts.sum(), 10);
      if (keeps) {
        EXPECT_THROW(resampler.resample(weights, 11, test_stream(1)), Error);
      } else {
        EXPECT_NO_THROW(resampler.resample(weights, 11, test_stream(1)));
      }
    }
  }
}

TEST(Resampling, UsesASchemeOfTheCallersOwn) {
  // All copies of the heaviest.
  ResamplingOptions options{ResamplingScheme::partial};
  options.own_scheme = [](ConstArray weights, int size, const RandomStream&,
                          MutableIndices counts) {
    Eigen::Index heaviest = 0;
    weights.maxCoeff(&heaviest);
    counts[heaviest] = size;
  };
  Resampler resampler(options);
  const Eigen::Array4d weights(0.1, 0.2, 0.6, 0.1);
  const ResamplingResult result = resampler.resample(weights, 6, test_stream(0));
  EXPECT_TRUE((result.counts == Eigen::Array4i(0, 0, 6, 0)).all());
  EXPECT_TRUE((result.ancestors == 2).all());
  EXPECT_TRUE((result.log_weights == -std::log(6.0)).all());
  EXPECT_FALSE(keeps_size(options));
}

// What a library has is loaded by scripts/check_examples.
TEST(Resampling, SaysWhyALibraryHasNoScheme) {
  ResamplingOptions options;
  ParameterList parameters;
  add_parameters(&options, &parameters);
  const auto refused = [&](const std::string& path) {
    return refusal([&] { set_parameter(parameters, "population/resampling/library", path); });
  };
  EXPECT_TRUE(says(refused("libno_such_scheme.so"), "libno_such_scheme.so"));
  EXPECT_TRUE(says(refused("libm.so.6"), "resampling_scheme"));
  EXPECT_EQ(options.library, "");
  EXPECT_FALSE(options.own_scheme);
  EXPECT_EQ(refused(""), "");
}

TEST(Resampling, RefusesCountsOfAnOwnSchemeThatAreNone) {
  Eigen::Array3i given(0, 4, 0);
  ResamplingOptions options;
  options.own_scheme = [&](ConstArray, int, const RandomStream&, MutableIndices counts) {
    counts += given;
  };
  Resampler resampler(options);
  const Eigen::ArrayXd weights = Eigen::ArrayXd::Ones(3);
  const auto resample = [&] { return resampler.resample(weights, 4, test_stream(0)).counts; };
  EXPECT_TRUE((resample() == given).all());
  for (const Eigen::Array3i& wrong : {Eigen::Array3i(0, 3, 0), Eigen::Array3i(-1, 5, 0)}) {
    given = wrong;
    EXPECT_THROW(resample(), Error);
  }
  // Nor do the failures leave a trace in the next result.
  given = {2, 2, 0};
  EXPECT_TRUE((resample() == given).all());
}

TEST(Resampling, RejectsOptionsOutsideTheirRanges) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  const auto expect_rejected = [](const ResamplingOptions& options, const std::string& name) {
    EXPECT_TRUE(says(refusal([&] { Resampler resampler(options); }), name));
  };
  for (const auto inner : {ResamplingScheme::partial, ResamplingScheme::rank_based}) {
    ResamplingOptions options;
    options.inner_scheme = inner;
    expect_rejected(options, "inner_scheme");
  }
  const auto expect_all_rejected = [&](double ResamplingOptions::*option, const std::string& name,
                                       const std::vector<double>& values) {
    for (const double value : values) {
      ResamplingOptions options;
      options.*option = value;
      expect_rejected(options, name);
    }
  };
  expect_all_rejected(&ResamplingOptions::partial_high, "partial_high",
                      {0.5, 0.1, nan, infinity, -1.0});
  expect_all_rejected(&ResamplingOptions::partial_low, "partial_low", {-0.1, 1.1, nan});
  expect_all_rejected(&ResamplingOptions::rank_max, "rank_max", {0.9, 2.1, nan});
  EXPECT_NO_THROW(Resampler{ResamplingOptions{}});
}

// The weights afterwards of all but partial and rank_based.
TEST(Resampling, LeavesEqualWeights) {
  Resampler resampler;
  for (const int size : {10, 20, 10, 1}) {
    const ResamplingResult result =
        resampler.resample(make_weights(Weights::skewed, 10), size, test_stream(1));
    for (int slot = 0; slot < size; ++slot) {
      ASSERT_NEAR(result.log_weights[slot], -std::log(size), 1e-15);
    }
  }
}

}  // namespace
}  // namespace pf_resampling
