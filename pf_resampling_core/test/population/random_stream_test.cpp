#include "pf_resampling_core/population/random_stream.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

namespace pf_resampling {
namespace {

RandomStream test_stream(std::uint32_t step = 0) {
  return RandomStream(5, RandomPurpose::test, step);
}

struct KnownAnswer {
  std::uint64_t counter[2];
  std::uint64_t key[2];
  std::uint64_t expected[2];
};

// kat_vectors of Random123 1.09 (Salmon et al. 2011): threefry 2x64, 20 rounds.
TEST(Threefry, GivesThePublishedVectors) {
  const std::uint64_t ones = ~std::uint64_t{0};
  const KnownAnswer known[] = {
      {{0, 0}, {0, 0}, {0xc2b6e3a8c2c69865u, 0x6f81ed42f350084du}},
      {{ones, ones}, {ones, ones}, {0xe02cb7c4d95d277au, 0xd06633d0893b8b68u}},
      {{0x243f6a8885a308d3u, 0x13198a2e03707344u},
       {0xa4093822299f31d0u, 0x082efa98ec4e6c89u},
       {0x263c7d30bb0f0af1u, 0x56be8361d3311526u}},
  };
  for (const KnownAnswer& answer : known) {
    std::uint64_t out[2];
    threefry2x64_20(answer.counter, answer.key, out);
    EXPECT_EQ(out[0], answer.expected[0]);
    EXPECT_EQ(out[1], answer.expected[1]);
  }
}

TEST(RandomStream, UniformsAreTheBitsOfTheGenerator) {
  // The documented mapping: the upper 52 bits, as odd multiples of 2^-53.
  const std::uint64_t key[2] = {77, (std::uint64_t{100} << 32) | 3};
  for (std::uint64_t block = 0; block < 100; ++block) {
    const std::uint64_t counter[2] = {block, 0};
    std::uint64_t out[2];
    threefry2x64_20(counter, key, out);
    const RandomStream stream(77, RandomPurpose::test, 3);
    for (std::uint64_t half = 0; half < 2; ++half) {
      const double expected =
          (2.0 * static_cast<double>(out[half] >> 12) + 1.0) * std::ldexp(1.0, -53);
      EXPECT_EQ(stream.uniform(2 * block + half), expected);
    }
  }
}

TEST(RandomStream, FillsWhatRandomAccessGives) {
  const RandomStream stream = test_stream();
  for (const std::uint64_t first : {0u, 1u, 2u, 7u, 1000001u}) {
    for (const std::int64_t count : {0, 1, 2, 3, 8, 17, 64, 65}) {
      std::vector<double> uniforms(static_cast<std::size_t>(count) + 1, -5.0);
      std::vector<double> normals(static_cast<std::size_t>(count) + 1, -50.0);
      stream.fill_uniform(first, count, uniforms.data());
      stream.fill_normal(first, count, normals.data());
      for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
        ASSERT_EQ(uniforms[i], stream.uniform(first + i)) << first << " " << count << " " << i;
        ASSERT_EQ(normals[i], stream.normal(first + i)) << first << " " << count << " " << i;
      }
      EXPECT_EQ(uniforms.back(), -5.0);  // nothing behind the end
      EXPECT_EQ(normals.back(), -50.0);
    }
  }
}

TEST(RandomStream, FillsFourNormalsAParticleFromFourOfTheStream) {
  const RandomStream stream = test_stream();
  for (const std::uint64_t first : {0u, 1u, 6u}) {
    constexpr std::size_t kCount = 37;
    std::vector<double> parts[4];
    for (auto& part : parts) part.resize(kCount);
    stream.fill_normal4(first, kCount, parts[0].data(), parts[1].data(), parts[2].data(),
                        parts[3].data());
    for (std::size_t i = 0; i < kCount; ++i) {
      for (std::size_t part = 0; part < 4; ++part) {
        ASSERT_EQ(parts[part][i], stream.normal(4 * (first + i) + part));
      }
    }
  }
}

// Wherever a fill begins and however long it is, particle i has its own four. Their moments: bounds
// of 4.89 deviations each, false alarm 9e-6 in all.
TEST(RandomStream, SingleNormalsAreNormal) {
  const RandomStream stream = test_stream();
  constexpr std::size_t kCount = 100003;
  std::vector<float> parts[4];
  for (auto& part : parts) part.resize(kCount);
  stream.fill_single_normal4(0, kCount, parts[0].data(), parts[1].data(), parts[2].data(),
                             parts[3].data());
  for (const std::size_t i : {1u, 7u, 256u, 100000u}) {
    float one[4];
    stream.fill_single_normal4(i, 1, &one[0], &one[1], &one[2], &one[3]);
    for (std::size_t part = 0; part < 4; ++part) EXPECT_EQ(one[part], parts[part][i]);
  }
  const double deviation = 4.89 / std::sqrt(static_cast<double>(kCount));
  for (std::size_t a = 0; a < 4; ++a) {
    double sum = 0.0;
    double fourth = 0.0;
    for (const float value : parts[a]) {
      sum += double{value};
      fourth += std::pow(double{value}, 4);
    }
    EXPECT_NEAR(sum / kCount, 0.0, deviation);
    EXPECT_NEAR(fourth / kCount, 3.0, deviation * std::sqrt(96.0));
    for (std::size_t b = 0; b <= a; ++b) {
      double product = 0.0;
      for (std::size_t i = 0; i < kCount; ++i) product += double{parts[a][i]} * double{parts[b][i]};
      EXPECT_NEAR(product / kCount, a == b ? 1.0 : 0.0,
                  deviation * (a == b ? std::sqrt(2.0) : 1.0));
    }
  }
}

TEST(RandomStream, NormalsAreBoxMullerOfTheUniforms) {
  const RandomStream stream = test_stream();
  const double two_pi = 2.0 * std::acos(-1.0);
  for (std::uint64_t i = 0; i < 10000; i += 2) {
    const double radius = std::sqrt(-2.0 * std::log(stream.uniform(i)));
    const double angle = two_pi * stream.uniform(i + 1);
    ASSERT_NEAR(stream.normal(i), radius * std::cos(angle), 2e-14);
    ASSERT_NEAR(stream.normal(i + 1), radius * std::sin(angle), 2e-14);
  }
}

TEST(RandomStream, DiffersBySeedPurposeAndStep) {
  std::set<double> seen;
  for (const std::uint64_t seed : {0u, 1u}) {
    for (const auto purpose : {RandomPurpose::motion, RandomPurpose::resampling}) {
      for (const std::uint32_t step : {0u, 1u, 0xffffffffu}) {
        const RandomStream stream(seed, purpose, step);
        for (std::uint64_t i = 0; i < 100; ++i) seen.insert(stream.uniform(i));
      }
    }
  }
  EXPECT_EQ(seen.size(), 1200u);
}

}  // namespace
}  // namespace pf_resampling
