#include "rviz_panel/strip_buffer.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace pf_resampling {
namespace {

TEST(StripBuffer, KeepsExtremesAndMeanOfEachColumn) {
  StripBuffer strip(10.0, 10);  // columns of one second
  for (const double value : {3.0, 1.0, 5.0}) strip.add(100.2, value);
  strip.add(101.5, 7.0);
  const auto columns = strip.columns();
  ASSERT_EQ(columns.size(), 2u);
  EXPECT_EQ(columns[0].low, 1.0);
  EXPECT_EQ(columns[0].high, 5.0);
  EXPECT_DOUBLE_EQ(columns[0].mean, 3.0);
  EXPECT_DOUBLE_EQ(columns[0].age, 1.0);  // 101.5 - 100.5
  EXPECT_FALSE(columns[0].follows);
  EXPECT_TRUE(columns[1].follows);
  EXPECT_EQ(strip.latest(), 7.0);
}

TEST(StripBuffer, ForgetsWhatIsOlderThanItsLength) {
  StripBuffer strip(10.0, 10);
  for (int second = 0; second < 1000; ++second) strip.add(second, second);
  const auto columns = strip.columns();
  ASSERT_EQ(columns.size(), 10u);
  EXPECT_EQ(columns.front().mean, 990.0);
  EXPECT_EQ(columns.back().mean, 999.0);
}

TEST(StripBuffer, AGapIsNotJoined) {
  StripBuffer strip(60.0, 600, 3.0);
  strip.add(10.0, 1.0);
  strip.add(12.9, 1.0);
  strip.add(16.0, 1.0);
  const auto columns = strip.columns();
  ASSERT_EQ(columns.size(), 3u);
  EXPECT_TRUE(columns[1].follows);
  EXPECT_FALSE(columns[2].follows);
}

// The recording with a gap of 97 s: nothing of before is left, and what comes is not joined to it.
TEST(StripBuffer, AGapLongerThanTheStripEmptiesIt) {
  StripBuffer strip;
  strip.add(10.0, 1.0);
  strip.add(107.0, 2.0);
  ASSERT_EQ(strip.columns().size(), 1u);
  EXPECT_FALSE(strip.columns()[0].follows);
  EXPECT_EQ(strip.columns()[0].mean, 2.0);
}

TEST(StripBuffer, TimeThatJumpsBackStartsAnew) {
  StripBuffer strip;
  strip.add(50.0, 1.0);
  strip.add(49.9, 2.0);  // out of order by little: kept
  EXPECT_DOUBLE_EQ(strip.columns().at(0).mean, 1.5);
  strip.add(3.0, 4.0);
  ASSERT_EQ(strip.columns().size(), 1u);
  EXPECT_DOUBLE_EQ(strip.columns()[0].mean, 4.0);
}

TEST(StripBuffer, WhatIsNotFiniteIsPassedOver) {
  StripBuffer strip;
  strip.add(1.0, std::numeric_limits<double>::quiet_NaN());
  strip.add(std::numeric_limits<double>::infinity(), 1.0);
  EXPECT_TRUE(strip.empty());
  EXPECT_TRUE(strip.columns().empty());
}

}  // namespace
}  // namespace pf_resampling
