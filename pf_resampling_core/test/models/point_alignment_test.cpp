#include "pf_resampling_core/models/point_alignment.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

using Points = std::vector<Eigen::Vector2d>;

TEST(AlignPoints, FindsATurnAndAShift) {
  const Pose2 pose = {3.0, -4.0, 2.5};
  const Points from = {{0.0, 0.0}, {1.0, 5.0}, {-2.0, 3.0}};
  Points to;
  for (const Eigen::Vector2d& point : from) to.push_back(moved(point, pose));
  const Pose2 found = align_points(from, to);
  EXPECT_NEAR(found.x, pose.x, 1e-12);
  EXPECT_NEAR(found.y, pose.y, 1e-12);
  EXPECT_NEAR(found.heading, pose.heading, 1e-12);
}

TEST(AlignPoints, GivesTheTurnOfUmeyamasExample) {
  // Umeyama 1991, section III: R = [0.832 0.555; -0.555 0.832], the same with or without scale; a
  // mirror image is not turned into a reflection.
  const Pose2 found =
      align_points({{0.0, 0.0}, {1.0, 0.0}, {0.0, 2.0}}, {{0.0, 0.0}, {-1.0, 0.0}, {0.0, 2.0}});
  EXPECT_NEAR(std::cos(found.heading), 0.832, 5e-4);
  EXPECT_NEAR(std::sin(found.heading), -0.555, 5e-4);
  // Without scale the shift is between the means, (1/3, 2/3) turned and (-1/3, 2/3).
  const double c = 3.0 / std::sqrt(13.0), s = -2.0 / std::sqrt(13.0);
  EXPECT_NEAR(found.x, -1.0 / 3.0 - (c / 3.0 - s * 2.0 / 3.0), 1e-12);
  EXPECT_NEAR(found.y, 2.0 / 3.0 - (s / 3.0 + c * 2.0 / 3.0), 1e-12);
}

TEST(AlignPoints, ShiftsOneAndCoincidingPointsOnly) {
  const Pose2 one = align_points({{1.0, 2.0}}, {{4.0, 6.0}});
  EXPECT_EQ(one.heading, 0.0);
  EXPECT_EQ(one.x, 3.0);
  EXPECT_EQ(one.y, 4.0);
  EXPECT_EQ(align_points({{1.0, 2.0}, {1.0, 2.0}}, {{0.0, 0.0}, {0.0, 0.0}}).heading, 0.0);
  EXPECT_THROW(align_points({}, {}), Error);
  EXPECT_THROW(align_points({{1.0, 2.0}}, {}), Error);
}

}  // namespace
}  // namespace pf_resampling
