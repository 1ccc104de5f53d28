#include "tools/common/batch_drive.hpp"
#include "pf_resampling_core/test/says.hpp"

#include <gtest/gtest.h>

#include "test/batch_testing.hpp"

namespace pf_resampling {
namespace {

/// Odometry at these times (s), at one place.
std::vector<StampedPose> standing_at(const std::vector<double>& times) {
  std::vector<StampedPose> path;
  for (const double time : times) {
    path.emplace_back();
    path.back().time = time;
  }
  return path;
}

// A pose at the start, every half second from there on, and at every observation in between.
TEST(CheckSize, CountsThePosesThatADriveWouldHave) {
  const auto said = [](double end, const std::vector<double>& times) {
    const auto odometry = standing_at({0.0, 0.25 * end, 0.5 * end, 0.75 * end, end});
    return refusal([&] { check_size(odometry, times); });
  };
  EXPECT_EQ(said(49999.5, {}), "");
  EXPECT_EQ(said(50000.0, {}),
            "the batch solution would need 100001 poses and takes 100000 at most: give a part of "
            "the recording (rosbag filter)");
  EXPECT_EQ(said(49999.0, {100.25}), "");
  EXPECT_NE(said(49999.0, {100.25, 200.35}), "");
  std::vector<double> times;
  for (int i = 1; i <= 200000; ++i) times.push_back(1e-3 * i);
  EXPECT_TRUE(says(said(200.0, times), " 200001 poses"));
}

// An hour is none that matters; what a clock that is set from 1970 to now leaves, is named.
TEST(CheckSize, NamesAGapOfTheOdometryThatIsTooLong) {
  EXPECT_EQ(refusal([] { check_size(standing_at({0.0, 1.0, 3601.0, 3602.0}), {}); }), "");
  EXPECT_EQ(refusal([] {
              check_size(standing_at({0.0, 12.5, 1.7e9, 1.7e9 + 9.0}), {0.5});
            }),
            "the odometry has a gap of 1699999988 s after 12.500 s: the batch solution would need "
            "3400000019 poses and takes 100000 at most; if the clock was set, cut the recording "
            "there (rosbag filter)");
}

}  // namespace
}  // namespace pf_resampling
