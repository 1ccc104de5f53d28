#include "pf_resampling_core/filters/fastslam/relocalization.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "pf_resampling_core/models/point_alignment.hpp"
#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

const std::vector<Eigen::Vector2d>& places_of_landmarks() {
  static const std::vector<Eigen::Vector2d> places = {
      {0.0, 0.0}, {4.0, 1.0}, {3.0, -2.0}, {-1.0, 5.0}, {7.0, 6.0}};
  return places;
}

// What a robot at `truth` that believes to be at `belief` has of the landmarks: closed form.
std::vector<LandmarkSighting> sightings(const Pose2& truth, const Pose2& belief) {
  const Pose2 back = compose(belief, relative(truth, Pose2{}));
  std::vector<LandmarkSighting> all;
  for (std::size_t id = 0; id < places_of_landmarks().size(); ++id) {
    all.push_back({static_cast<std::int64_t>(id), moved(places_of_landmarks()[id], back),
                   places_of_landmarks()[id], 0.1});
  }
  return all;
}

const Pose2 kTruth{2.0, 3.0, 0.7};
const Pose2 kBelief{-5.0, 1.0, -2.0};

TEST(Relocalization, ExactSightingsGiveTheExactPose) {
  const auto found = relocalize(sightings(kTruth, kBelief), kBelief);
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(found->mean.x, kTruth.x, 1e-9);
  EXPECT_NEAR(found->mean.y, kTruth.y, 1e-9);
  EXPECT_NEAR(wrap_angle(found->mean.heading - kTruth.heading), 0.0, 1e-9);
}

TEST(Relocalization, TwoLandmarksAreEnough) {
  auto two = sightings(kTruth, kBelief);
  two.resize(2);
  const auto found = relocalize(two, kBelief);
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(found->mean.x, kTruth.x, 1e-9);
  // Two points 17^(1/2) m apart, each 0.1 m uncertain: the heading by 0.1 over the root of their
  // moment 17/2.
  EXPECT_NEAR(std::sqrt(found->covariance(2, 2)), 0.1 / std::sqrt(8.5), 1e-9);
}

TEST(Relocalization, MisreadIdsDoNotMatterWhileMostAreRight) {
  auto some = sightings(kTruth, kBelief);
  some[1].mapped = places_of_landmarks()[4];  // read as 4
  const auto found = relocalize(some, kBelief);
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(found->mean.x, kTruth.x, 1e-9);
  EXPECT_NEAR(found->mean.y, kTruth.y, 1e-9);
}

TEST(Relocalization, WhatDoesNotAgreeIsNoPlace) {
  auto wrong = sightings(kTruth, kBelief);
  wrong.resize(4);
  std::swap(wrong[0].mapped, wrong[1].mapped);
  std::swap(wrong[2].mapped, wrong[3].mapped);
  EXPECT_FALSE(relocalize(wrong, kBelief).has_value());
}

TEST(Relocalization, OneLandmarkHoweverOftenSeenIsNoPlace) {
  const LandmarkSighting one = sightings(kTruth, kBelief).front();
  EXPECT_FALSE(relocalize({one, one, one, one, one}, kBelief).has_value());
  EXPECT_FALSE(relocalize({}, kBelief).has_value());
}

// Two landmarks closer than they are certain tell no heading.
TEST(Relocalization, LandmarksSideBySideTellNoHeading) {
  LandmarkSighting left{0, {0.0, 0.0}, {10.0, 0.0}, 0.1};
  LandmarkSighting right{1, {0.05, 0.0}, {10.05, 0.0}, 0.1};
  EXPECT_FALSE(relocalize({left, right, left, right}, kBelief).has_value());
}

// Of 200 noisy trials none is off by more than the covariance allows: a squared distance of 40 with
// three degrees of freedom has a probability of 1e-8.
TEST(Relocalization, TheCovarianceCoversTheErrors) {
  for (std::uint32_t trial = 0; trial < 200; ++trial) {
    const RandomStream noise(3, RandomPurpose::test, trial);
    auto noisy = sightings(kTruth, kBelief);
    for (std::size_t k = 0; k < noisy.size(); ++k) {
      noisy[k].seen += 0.07 * Eigen::Vector2d(noise.normal(2 * k), noise.normal(2 * k + 1));
    }
    const auto found = relocalize(noisy, kBelief);
    ASSERT_TRUE(found.has_value());
    EXPECT_EQ(found->covariance, found->covariance.transpose());
    const Eigen::Vector3d error(found->mean.x - kTruth.x, found->mean.y - kTruth.y,
                                wrap_angle(found->mean.heading - kTruth.heading));
    EXPECT_LT(error.dot(found->covariance.ldlt().solve(error)), 40.0) << "trial " << trial;
  }
}

}  // namespace
}  // namespace pf_resampling
