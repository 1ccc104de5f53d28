#include "pf_resampling_core/models/lost_error.hpp"

#include <gtest/gtest.h>

namespace pf_resampling {
namespace {

TEST(LostError, IsRadioNoiseAndAShareOfTheScene) {
  EXPECT_NEAR(lost_error(96.0), 3.08, 1e-12);
  EXPECT_NEAR(lost_error(0.0), 0.2, 1e-12);
}

}  // namespace
}  // namespace pf_resampling
