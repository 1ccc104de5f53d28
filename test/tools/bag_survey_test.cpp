#include "tools/checks/bag_survey.hpp"

#include <gtest/gtest.h>

namespace pf_resampling {
namespace {

TEST(TopicSurvey, LeavesOutStampsThatFiltersReject) {
  TopicSurvey topic;
  topic.add(ros::Time(11.0), ros::Time(11.5));
  for (const std::uint32_t seconds : {0u, 0x80000000u, 0xffffffffu}) {
    topic.add(ros::Time(seconds, 0), ros::Time(12.0));
  }
  topic.add(ros::Time(14.0), ros::Time(14.25));
  topic.add(ros::Time(12.0), ros::Time(12.0));  // late: closes no gap, and opens none
  topic.add(ros::Time(15.0), ros::Time(15.0));
  EXPECT_EQ(topic.longest_gap, 3.0);
  EXPECT_EQ(topic.longest_gap_at, 11.0);
  EXPECT_EQ(topic.largest_delay, 0.5);
}

}  // namespace
}  // namespace pf_resampling
