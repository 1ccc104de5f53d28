#include "tools/common/text.hpp"

#include <gtest/gtest.h>

namespace pf_resampling {
namespace {

TEST(Fixed, RoundsToDecimals) {
  EXPECT_EQ(fixed(1.256, 2), "1.26");
  EXPECT_EQ(fixed(-3.0, 0), "-3");
  EXPECT_EQ(fixed(1e12, 1), "1000000000000.0");
}

}  // namespace
}  // namespace pf_resampling
