#include "pf_resampling_core/evaluation/path_errors.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <limits>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

// 100 s at 10 Hz along a line of 60 m in direction 0.6 rad, so the extent is 60 m and the usual
// bound of being lost 2 m.
constexpr double kDirection = 0.6;
constexpr int kPoses = 1001;

std::vector<TruePose> straight_truth(bool with_heading = true) {
  std::vector<TruePose> truth;
  for (int i = 0; i < kPoses; ++i) {
    const double s = 60.0 * i / (kPoses - 1);
    TruePose pose = {0.1 * i, s * std::cos(kDirection), s * std::sin(kDirection), {}};
    if (with_heading) pose.heading = kDirection;
    truth.push_back(pose);
  }
  return truth;
}

// The truth, moved along and to the left of the direction of travel.
std::vector<EstimatedPose> displaced(const std::vector<TruePose>& truth, double along, double left,
                                     double turn = 0.0) {
  std::vector<EstimatedPose> path;
  for (const TruePose& pose : truth) {
    EstimatedPose estimate;
    estimate.time = pose.time;
    estimate.pose = compose({pose.x, pose.y, kDirection}, {along, left, turn});
    estimate.covariance = Eigen::Matrix3d::Identity();
    path.push_back(estimate);
  }
  return path;
}

TEST(PathErrors, AreNormalizedByTheirCovariance) {
  const Eigen::Matrix2d covariance = Eigen::Vector2d(4.0, 1.0).asDiagonal();
  EXPECT_DOUBLE_EQ(normalized_squared(covariance, {2.0, 3.0}), 10.0);
  EXPECT_TRUE(std::isinf(normalized_squared(Eigen::Matrix2d::Zero(), {2.0, 3.0})));
}

TEST(PathErrors, SplitsALateralOffset) {
  const auto truth = straight_truth();
  const PathErrors errors = evaluate_path(truth, displaced(truth, 0.0, -1.0));
  EXPECT_NEAR(errors.cross_track.mean, 1.0, 1e-12);
  EXPECT_NEAR(errors.cross_track.max, 1.0, 1e-12);
  EXPECT_NEAR(errors.cross_track.std, 0.0, 1e-12);
  EXPECT_NEAR(errors.along_track.max, 0.0, 1e-12);
  EXPECT_NEAR(errors.cartesian.mean, 1.0, 1e-12);
  EXPECT_NEAR(errors.heading.max, 0.0, 1e-12);
  EXPECT_NEAR(*errors.samples[7].cross_track, -1.0, 1e-12) << "to the right is negative";
  EXPECT_EQ(errors.cross_track.count, kPoses);
}

TEST(PathErrors, SplitsAnOffsetAhead) {
  const auto truth = straight_truth();
  const PathErrors errors = evaluate_path(truth, displaced(truth, 3.0, 4.0));
  EXPECT_NEAR(errors.along_track.mean, 3.0, 1e-12);
  EXPECT_NEAR(errors.cross_track.mean, 4.0, 1e-12);
  EXPECT_NEAR(errors.cartesian.mean, 5.0, 1e-12);
  EXPECT_NEAR(errors.cartesian.rms, 5.0, 1e-12);
}

TEST(PathErrors, TakesTheDirectionOfTravelWithoutHeading) {
  const auto truth = straight_truth(false);
  const PathErrors errors = evaluate_path(truth, displaced(truth, 3.0, 4.0));
  EXPECT_NEAR(errors.along_track.mean, 3.0, 1e-9);
  EXPECT_NEAR(errors.cross_track.mean, 4.0, 1e-9);
  EXPECT_EQ(errors.heading.count, 0);
  EXPECT_FALSE(errors.coverage95_pose);
}

TEST(PathErrors, UsesTheTrueHeadingAndNotTheDirectionOfTravel) {
  auto truth = straight_truth();
  for (TruePose& pose : truth) pose.heading = kDirection + kPi / 2.0;  // driving sideways
  const PathErrors errors = evaluate_path(truth, displaced(truth, 3.0, 4.0));
  EXPECT_NEAR(errors.along_track.mean, 4.0, 1e-12);
  EXPECT_NEAR(errors.cross_track.mean, 3.0, 1e-12);
}

TEST(PathErrors, MeasuresTheHeadingOnTheCircle) {
  auto truth = straight_truth();
  auto estimate = displaced(truth, 0.0, 0.0);
  for (TruePose& pose : truth) pose.heading = kPi - 0.1;
  for (EstimatedPose& pose : estimate) pose.pose.heading = -kPi + 0.1;
  EXPECT_NEAR(evaluate_path(truth, estimate).heading.max, 0.2, 1e-12);
}

TEST(PathErrors, ComparesAtTheStampsOfTheTruth) {
  const auto truth = straight_truth();
  auto estimate = displaced(truth, 0.0, 0.0);
  // Every third pose only, and between the true stamps: linear motion is interpolated exactly.
  std::vector<EstimatedPose> sparse;
  for (std::size_t i = 0; i < estimate.size(); i += 3) {
    EstimatedPose pose = estimate[i];
    pose.time += 0.03;
    pose.pose = compose(pose.pose, {0.03 * 0.6, 0.0, 0.0});
    sparse.push_back(pose);
  }
  const PathErrors errors = evaluate_path(truth, sparse);
  EXPECT_NEAR(errors.cartesian.max, 0.0, 1e-9);
  // Poses are at 0.03, 0.33, ... 99.93 s: the first true pose and the last are outside.
  EXPECT_EQ(errors.cartesian.count, kPoses - 2);
  EXPECT_EQ(errors.uncovered, 2);
}

TEST(AbsoluteErrors, AreOfTheAbsoluteValue) {
  // |1, -2, 3, -6|: mean 3, deviations -2, -1, 0, 3, variance 14/4, mean square 50/4.
  const AbsoluteErrors errors = absolute_errors({1.0, -2.0, 3.0, -6.0});
  EXPECT_EQ(errors.count, 4);
  EXPECT_DOUBLE_EQ(errors.mean, 3.0);
  EXPECT_DOUBLE_EQ(errors.max, 6.0);
  EXPECT_DOUBLE_EQ(errors.std, std::sqrt(3.5));
  EXPECT_DOUBLE_EQ(errors.rms, std::sqrt(12.5));
  EXPECT_EQ(absolute_errors({}).count, 0);
}

TEST(PathErrors, ClipsTheFirstPartByTime) {
  const auto truth = straight_truth();
  auto estimate = displaced(truth, 0.0, 0.0);
  for (std::size_t i = 0; i < 200; ++i) estimate[i].pose.x += 30.0;  // until just before 20 s
  PathErrorOptions options;
  options.clip = 0.2;
  const PathErrors clipped = evaluate_path(truth, estimate, options);
  EXPECT_NEAR(clipped.cartesian.max, 0.0, 1e-12);
  EXPECT_EQ(clipped.cartesian.count, 801);
  EXPECT_EQ(clipped.samples.size(), 1001u);
  EXPECT_NEAR(evaluate_path(truth, estimate).cartesian.mean, 30.0 * 200.0 / 1001.0, 1e-9);
}

TEST(PathErrors, DoesNotFillGaps) {
  const auto truth = straight_truth();
  auto estimate = displaced(truth, 0.0, 0.0);
  estimate.erase(estimate.begin() + 300, estimate.begin() + 350);  // 29.9 to 35.0 s
  EXPECT_EQ(evaluate_path(truth, estimate).uncovered, 50);
  PathErrorOptions options;
  options.max_gap = 6.0;
  EXPECT_EQ(evaluate_path(truth, estimate, options).uncovered, 0);
}

TEST(PathErrors, CoverageIsThatOfTheEllipse) {
  const auto truth = straight_truth();
  auto estimate = displaced(truth, 2.0, 0.0);
  // An ellipse of 1 m along and 0.1 m across the path: 2 m ahead is inside 95 % (4 < 5.99) and 3
  // sigma, 2 m to the left is far outside.
  const Eigen::Vector2d ahead(std::cos(kDirection), std::sin(kDirection));
  Eigen::Matrix3d covariance = 0.01 * Eigen::Matrix3d::Identity();
  covariance.topLeftCorner<2, 2>() += 0.99 * ahead * ahead.transpose();
  for (EstimatedPose& pose : estimate) pose.covariance = covariance;
  const PathErrors inside = evaluate_path(truth, estimate);
  EXPECT_DOUBLE_EQ(*inside.coverage95, 1.0);
  EXPECT_DOUBLE_EQ(*inside.coverage_3sigma, 1.0);
  EXPECT_NEAR(*inside.normalized_error, 4.0, 1e-9);
  EXPECT_NEAR(inside.samples[5].along_track_sigma, 1.0, 1e-9);
  EXPECT_NEAR(inside.samples[5].cross_track_sigma, 0.1, 1e-9);
  EXPECT_NEAR(inside.samples[5].position_sigma, 1.0, 1e-9);

  estimate = displaced(truth, 0.0, 2.0);
  for (EstimatedPose& pose : estimate) pose.covariance = covariance;
  EXPECT_DOUBLE_EQ(*evaluate_path(truth, estimate).coverage95, 0.0);

  // 2.7 m ahead: outside 95 % (7.29), inside 3 sigma (9), inside 95 % of the pose (7.81).
  estimate = displaced(truth, 2.7, 0.0);
  for (EstimatedPose& pose : estimate) pose.covariance = covariance;
  const PathErrors between = evaluate_path(truth, estimate);
  EXPECT_DOUBLE_EQ(*between.coverage95, 0.0);
  EXPECT_DOUBLE_EQ(*between.coverage_3sigma, 1.0);
  EXPECT_DOUBLE_EQ(*between.coverage95_pose, 1.0);
}

TEST(PathErrors, CoverageOfGaussianErrorsIsNominal) {
  const auto truth = straight_truth();
  Eigen::Matrix3d covariance;
  covariance << 0.5, 0.3, 0.02, 0.3, 0.4, -0.01, 0.02, -0.01, 0.01;
  const Eigen::Matrix3d root = covariance.llt().matrixL();
  int inside95 = 0, inside95_pose = 0, inside_3sigma = 0, count = 0;
  for (std::uint32_t run = 0; run < 20; ++run) {
    auto estimate = displaced(truth, 0.0, 0.0);
    const RandomStream stream(4, RandomPurpose::test, run);
    for (std::size_t i = 0; i < estimate.size(); ++i) {
      const Eigen::Vector3d error =
          root *
          Eigen::Vector3d(stream.normal(3 * i), stream.normal(3 * i + 1), stream.normal(3 * i + 2));
      estimate[i].pose.x += error.x();
      estimate[i].pose.y += error.y();
      estimate[i].pose.heading += error.z();
      estimate[i].covariance = covariance;
    }
    const PathErrors errors = evaluate_path(truth, estimate);
    count += errors.cartesian.count;
    inside95 += static_cast<int>(std::lround(*errors.coverage95 * errors.cartesian.count));
    inside95_pose +=
        static_cast<int>(std::lround(*errors.coverage95_pose * errors.cartesian.count));
    inside_3sigma +=
        static_cast<int>(std::lround(*errors.coverage_3sigma * errors.cartesian.count));
  }
  // Binomial with n = 20,020 and p = 0.95, 0.95, 1 - exp(-9/2); five standard deviations, 6e-7
  // each.
  const double n = count;
  ASSERT_EQ(count, 20 * kPoses);
  EXPECT_NEAR(inside95 / n, 0.95, 5.0 * std::sqrt(0.95 * 0.05 / n));
  EXPECT_NEAR(inside95_pose / n, 0.95, 5.0 * std::sqrt(0.95 * 0.05 / n));
  EXPECT_NEAR(inside_3sigma / n, 0.98889, 5.0 * std::sqrt(0.98889 * 0.01111 / n));
}

TEST(PathErrors, NoCovarianceNoCoverageAndASingularOneContainsNothing) {
  const auto truth = straight_truth();
  auto estimate = displaced(truth, 0.0, 0.0);
  for (EstimatedPose& pose : estimate) pose.covariance.setZero();
  EXPECT_FALSE(evaluate_path(truth, estimate).coverage95);
  for (EstimatedPose& pose : estimate) pose.covariance(0, 0) = 1.0;
  EXPECT_DOUBLE_EQ(*evaluate_path(truth, estimate).coverage95, 0.0);
}

TEST(PathErrors, ConvergesWhenTheErrorStaysSmallForTenSeconds) {
  const auto truth = straight_truth();
  auto estimate = displaced(truth, 0.0, 0.0);
  EXPECT_DOUBLE_EQ(*evaluate_path(truth, estimate).converged_after, 0.0);
  EXPECT_NEAR(evaluate_path(truth, estimate).lost_error, 0.2 + 0.03 * 60.0, 1e-9);
  // Off until 15 s, save for 8 s that are too short to count; and again at 60 s, which no longer
  // matters.
  for (std::size_t i = 0; i < 150; ++i) {
    if (i < 50 || i > 130) estimate[i].pose.x += 10.0;
  }
  for (std::size_t i = 600; i < 650; ++i) estimate[i].pose.x += 10.0;
  const PathErrors errors = evaluate_path(truth, estimate);
  EXPECT_NEAR(*errors.converged_after, 15.0, 1e-9);
  EXPECT_FALSE(errors.lost);
}

TEST(PathErrors, ConvergenceNearTheEndHasToLastToTheEnd) {
  const auto truth = straight_truth();
  auto estimate = displaced(truth, 0.0, 0.0);
  for (std::size_t i = 0; i < 950; ++i) estimate[i].pose.y += 10.0;
  EXPECT_NEAR(*evaluate_path(truth, estimate).converged_after, 95.0, 1e-9);
  estimate.back().pose.y += 10.0;
  EXPECT_FALSE(evaluate_path(truth, estimate).converged_after);
}

// A filter that knows where it is, but not where it looks, has not converged.
TEST(PathErrors, ConvergesWhenTheHeadingIsKnownToo) {
  auto truth = straight_truth();
  auto estimate = displaced(truth, 0.0, 0.0);
  for (std::size_t i = 0; i < 220; ++i) estimate[i].pose.heading += 2.0;
  for (std::size_t i = 220; i < 300; ++i) estimate[i].pose.heading -= 0.5;
  const PathErrors errors = evaluate_path(truth, estimate);
  ASSERT_TRUE(errors.converged_after);
  EXPECT_NEAR(*errors.converged_after, 22.0, 1e-9);
  EXPECT_EQ(errors.lost_share, 0.0);
  for (TruePose& pose : truth) pose.heading.reset();
  EXPECT_EQ(*evaluate_path(truth, estimate).converged_after, 0.0);
}

TEST(PathErrors, TimeWithoutAnEstimateIsNotConverged) {
  const auto truth = straight_truth();
  auto estimate = displaced(truth, 0.0, 0.0);
  estimate.erase(estimate.begin(), estimate.begin() + 123);
  EXPECT_NEAR(*evaluate_path(truth, estimate).converged_after, 12.3, 1e-9);
}

TEST(PathErrors, IsLostWhenTheErrorIsAboveTheBoundForATenthOfTheTime) {
  const auto truth = straight_truth();
  PathErrorOptions options;
  EXPECT_FALSE(evaluate_path(truth, displaced(truth, 1.9, 0.0), options).lost);
  EXPECT_TRUE(evaluate_path(truth, displaced(truth, 2.1, 0.0), options).lost);
  const auto off_between = [&](std::size_t from, std::size_t to) {
    auto estimate = displaced(truth, 0.0, 0.0);
    for (std::size_t i = from; i < to; ++i) estimate[i].pose.x += 30.0;
    return evaluate_path(truth, estimate, options);
  };
  // The first 20 s never count, of the 801 poses after them 80 may be off.
  EXPECT_FALSE(off_between(0, 200).lost);
  EXPECT_FALSE(off_between(0, 280).lost);
  EXPECT_TRUE(off_between(0, 281).lost);
  EXPECT_FALSE(off_between(500, 580).lost);
  EXPECT_TRUE(off_between(500, 581).lost);
  EXPECT_TRUE(off_between(900, 1001).lost);
  EXPECT_DOUBLE_EQ(off_between(0, 280).lost_share, 280.0 / 1001.0);
  // A longer clip leaves more out: of 501 poses 50 may be off.
  options.clip = 0.5;
  EXPECT_FALSE(off_between(0, 550).lost);
  EXPECT_TRUE(off_between(0, 551).lost);
  EXPECT_DOUBLE_EQ(off_between(0, 551).lost_share, 51.0 / 501.0);
}

TEST(PathErrors, IsLostWhenTheEstimateStops) {
  const auto truth = straight_truth();
  auto estimate = displaced(truth, 0.0, 0.0);
  estimate.resize(900);
  EXPECT_TRUE(evaluate_path(truth, estimate).lost);
  estimate = displaced(truth, 0.0, 0.0);
  estimate.resize(930);
  EXPECT_FALSE(evaluate_path(truth, estimate).lost);
}

TEST(PathErrors, RefusesWhatItCannotJudge) {
  const auto truth = straight_truth();
  const auto estimate = displaced(truth, 0.0, 0.0);
  PathErrorOptions options;
  options.clip = 1.0;
  EXPECT_THROW(evaluate_path(truth, estimate, options), Error);
  options.clip = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(evaluate_path(truth, estimate, options), Error);
  EXPECT_THROW(evaluate_path(truth, {}), Error);
  EXPECT_THROW(evaluate_path({}, estimate), Error);
  auto later = estimate;
  for (EstimatedPose& pose : later) pose.time += 1000.0;
  EXPECT_THROW(evaluate_path(truth, later), Error);
  auto broken = estimate;
  broken[3].covariance(0, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(evaluate_path(truth, broken), Error);
}

}  // namespace
}  // namespace pf_resampling
