#include "tools/checks/stamps.hpp"

#include <gtest/gtest.h>

namespace pf_resampling {
namespace {

StampSummary summary_of(const std::vector<double>& stamps) {
  StampCheck check;
  for (const double stamp : stamps) check.add(ros::Time(stamp), ros::Time(100.0));
  return check.summary();
}

TEST(StampCheck, FindsRateAndGaps) {
  // Periods 1, 1, 5, 1, 5.5, 1: the median is 1; a gap is longer than five of it.
  const StampSummary summary = summary_of({10, 11, 12, 17, 18, 23.5, 24.5});
  EXPECT_EQ(summary.messages, 7U);
  EXPECT_DOUBLE_EQ(summary.rate(), 6.0 / 14.5);
  EXPECT_DOUBLE_EQ(summary.median_period, 1.0);
  EXPECT_DOUBLE_EQ(summary.longest_gap, 5.5);
  EXPECT_DOUBLE_EQ(summary.longest_gap_at, 18.0);
  EXPECT_EQ(summary.gaps, 1U);
  EXPECT_DOUBLE_EQ(summary.largest_delay, 90.0);
}

// ROS throws where a difference of times has no room in 32 bits.
TEST(StampCheck, LeavesOutWhatRosCannotReckonWith) {
  StampCheck check;
  check.add(ros::Time(10.0), ros::Time(10.0));
  for (const std::uint32_t seconds : {0x80000000U, 0xffffffffU}) {
    ros::Time late;
    late.sec = seconds;
    late.nsec = 999999999;
    check.add(late, ros::Time(10.0));
  }
  ros::Time overfull;
  overfull.sec = 11;
  overfull.nsec = 1000000000;
  check.add(overfull, ros::Time(10.0));
  check.add(ros::Time(11.0), ros::Time(11.5));
  check.add(ros::Time(0x7fffffff, 0), ros::Time(1.0));  // the last that it can
  const StampSummary summary = check.summary();
  EXPECT_EQ(summary.messages, 3U);
  EXPECT_EQ(summary.first, 10.0);
  EXPECT_EQ(summary.last, 2147483647.0);
  EXPECT_EQ(summary.longest_gap, 2147483636.0);
  EXPECT_EQ(summary.largest_delay, 2147483646.0);
}

TEST(StampCheck, OfNothingIsNothing) {
  EXPECT_EQ(summary_of({}).rate(), 0.0);
  EXPECT_EQ(summary_of({5.0}).rate(), 0.0);
  EXPECT_EQ(summary_of({0.0}).messages, 0U);
}

}  // namespace
}  // namespace pf_resampling
