#include "pf_resampling_core/evaluation/statistics.hpp"

#include <gtest/gtest.h>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

TEST(Median, OfOddAndEvenNumbers) {
  EXPECT_DOUBLE_EQ(median({5.0, 1.0, 3.0}), 3.0);
  EXPECT_DOUBLE_EQ(median({5.0, 1.0, 4.0, 2.0}), 3.0);
  EXPECT_THROW(median({}), Error);
}

}  // namespace
}  // namespace pf_resampling
