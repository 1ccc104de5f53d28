#include "pf_resampling_core/population/ancestry.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

// The definition, one particle at a time.
Eigen::ArrayXi expected_ancestors(const Eigen::ArrayXi& counts, int slots) {
  std::vector<int> ancestors(static_cast<std::size_t>(slots), -1);
  std::vector<int> others;
  for (int i = 0; i < counts.size(); ++i) {
    int copies = counts[i];
    if (copies > 0 && i < slots) {
      ancestors[static_cast<std::size_t>(i)] = i;
      --copies;
    }
    others.insert(others.end(), static_cast<std::size_t>(copies), i);
  }
  auto next = others.begin();
  for (int& ancestor : ancestors) {
    if (ancestor < 0) ancestor = *next++;
  }
  return Eigen::Map<const Eigen::ArrayXi>(ancestors.data(), slots);
}

void expect_definition(const Eigen::ArrayXi& counts) {
  const int slots = counts.sum();
  Eigen::ArrayXi ancestors = Eigen::ArrayXi::Constant(slots, -7);
  counts_to_ancestors(counts, ancestors);
  ASSERT_TRUE((ancestors == expected_ancestors(counts, slots)).all());
}

TEST(CountsToAncestors, KeepsSurvivorsInTheirSlots) {
  Eigen::ArrayXi counts(6);
  counts << 0, 3, 0, 1, 2, 0;
  Eigen::ArrayXi ancestors(6);
  counts_to_ancestors(counts, ancestors);
  Eigen::ArrayXi expected(6);
  expected << 1, 1, 1, 3, 4, 4;
  EXPECT_TRUE((ancestors == expected).all());
}

TEST(CountsToAncestors, IsTheDefinitionForAllSizesAndSpreads) {
  std::uint32_t step = 0;
  for (const int particles : {1, 2, 63, 1000, 3000}) {
    // From all survive to a few with very many copies.
    for (const double power : {0.0, 0.1, 1.0, 3.0, 30.0}) {
      for (int trial = 0; trial < 10; ++trial) {
        Eigen::ArrayXd uniforms(particles);
        RandomStream(1, RandomPurpose::test, step++).fill_uniform(0, particles, uniforms.data());
        Eigen::ArrayXi counts = ((1.0 + power) * uniforms.pow(power)).cast<int>();
        if (counts.sum() == 0) counts[0] = particles;
        ASSERT_NO_FATAL_FAILURE(expect_definition(counts)) << particles << " " << power;
      }
    }
  }
}

TEST(CountsToAncestors, HandlesOneAncestorOfAll) {
  for (const int particles : {1, 5, 1000}) {
    for (const int hot : {0, particles / 2, particles - 1}) {
      for (const int slots : {particles, 1, 3 * particles}) {
        Eigen::ArrayXi counts = Eigen::ArrayXi::Zero(particles);
        counts[hot] = slots;
        ASSERT_NO_FATAL_FAILURE(expect_definition(counts));
      }
    }
  }
}

TEST(CountDistinct, CountsDifferentValues) {
  Eigen::ArrayXi ancestors(5);
  ancestors << 3, 0, 3, 3, 9;
  std::vector<std::uint8_t> seen;
  EXPECT_EQ(count_distinct(ancestors, 10, &seen), 3);
  EXPECT_EQ(count_distinct(ancestors, 10, &seen), 3);  // the working space starts afresh
}

TEST(Ancestry, FollowsAncestorsThroughSelections) {
  Ancestry ancestry;
  ancestry.start(4);
  EXPECT_EQ(ancestry.distinct(), 4);
  Eigen::ArrayXi first(4);
  first << 0, 2, 2, 3;
  ancestry.select(first);
  EXPECT_EQ(ancestry.distinct(), 3);
  Eigen::ArrayXi second(5);  // the number may change
  second << 1, 1, 2, 3, 3;
  ancestry.select(second);
  // They descend from 2, 2, 2, 3, 3.
  EXPECT_EQ(ancestry.distinct(), 2);
  ancestry.start(3);
  EXPECT_EQ(ancestry.distinct(), 3);
}

}  // namespace
}  // namespace pf_resampling
