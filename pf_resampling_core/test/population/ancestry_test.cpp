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

TEST(CountsToAncestors, IsTheDefinitionForAllSizesAndSpreads) {
  std::uint32_t step = 0;
  for (const int particles : {1, 2, 63, 64, 65, 255, 256, 257, 511, 512, 513, 1000, 3000}) {
    for (int spread = 0; spread < 8; ++spread) {
      for (int trial = 0; trial < 10; ++trial) {
        const RandomStream stream(1, RandomPurpose::test, step++);
        Eigen::ArrayXi counts(particles);
        for (int i = 0; i < particles; ++i) {
          const double u = stream.uniform(static_cast<std::uint64_t>(i));
          // From all survive to a few with very many copies.
          counts[i] = spread == 0   ? 1
                      : spread == 1 ? static_cast<int>(u * 3.0)
                      : spread == 2 ? static_cast<int>(u * u * 5.0)
                      : spread == 3 ? static_cast<int>(u * 40.0)
                      : spread == 4 ? (u < 0.99 ? 0 : 300)
                      : spread == 5 ? (u < 0.9 ? 0 : 17)
                      : spread == 6 ? (u < 0.9 ? 2 : 0)
                                    : (u < 0.3 ? 0 : 1);
        }
        if (counts.sum() == 0) counts[0] = particles;
        ASSERT_NO_FATAL_FAILURE(expect_definition(counts)) << particles << " " << spread;
      }
    }
  }
}

TEST(CountsToAncestors, HandlesOneAncestorOfAll) {
  for (const int particles : {1, 5, 256, 1000, 100000}) {
    for (const int hot : {0, particles / 2, particles - 1}) {
      for (const int slots : {particles, 1, 3 * particles}) {
        Eigen::ArrayXi counts = Eigen::ArrayXi::Zero(particles);
        counts[hot] = slots;
        Eigen::ArrayXi ancestors(slots);
        counts_to_ancestors(counts, ancestors);
        ASSERT_TRUE((ancestors == hot).all());
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
