#include "pf_resampling_core/evaluation/map_errors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

using Points = std::vector<Eigen::Vector2d>;

PointLandmark landmark(int id, double x, double y, double variance = 0.0) {
  return {id, {x, y}, variance * Eigen::Matrix2d::Identity()};
}

/// Corners of a rectangle and its middle, ids 10 to 14.
std::vector<PointLandmark> true_map() {
  return {landmark(10, 0, 0), landmark(11, 8, 0), landmark(12, 8, 6), landmark(13, 0, 6),
          landmark(14, 4, 3)};
}

TEST(Moved, TurnsCovariances) {
  PointLandmark narrow = landmark(1, 1.0, 0.0);
  narrow.covariance << 4.0, 0.0, 0.0, 1.0;
  const auto map = moved({narrow}, Pose2{0.0, 0.0, 0.5 * kPi});
  EXPECT_NEAR(map[0].position.y(), 1.0, 1e-12);
  EXPECT_NEAR(map[0].covariance(0, 0), 1.0, 1e-12);
  EXPECT_NEAR(map[0].covariance(1, 1), 4.0, 1e-12);
  EstimatedPose pose;
  pose.covariance.diagonal() << 4.0, 1.0, 0.25;
  const auto path = moved({pose}, Pose2{1.0, 2.0, 0.5 * kPi});
  EXPECT_EQ(path[0].pose.x, 1.0);
  EXPECT_NEAR(path[0].covariance(1, 1), 4.0, 1e-12);
  EXPECT_EQ(path[0].covariance(2, 2), 0.25);
}

TEST(EvaluateAlignedPath, SeesTheShapeAlone) {
  // A quarter of a circle in a frame of its own; every other pose of its later half 0.3 m off, the
  // first tenth by kilometres.
  const Pose2 frame = {100.0, -50.0, 1.0};
  std::vector<TruePose> truth;
  std::vector<EstimatedPose> estimate;
  for (int i = 0; i <= 100; ++i) {
    const double angle = 0.005 * kPi * i;
    TruePose pose = {static_cast<double>(i), 10.0 * std::cos(angle), 10.0 * std::sin(angle), {}};
    truth.push_back(pose);
    const Eigen::Vector2d there = moved({pose.x, pose.y}, frame);
    EstimatedPose other;
    other.time = pose.time;
    other.pose = {there.x() + (i < 10 ? 5000.0 : 0.0), there.y(), 0.0};
    estimate.push_back(other);
  }
  const AlignedPathErrors exact = evaluate_aligned_path(truth, estimate, {0.1, 0.0});
  EXPECT_EQ(exact.cartesian.count, 91);
  EXPECT_NEAR(exact.cartesian.max, 0.0, 1e-9);
  EXPECT_NEAR(exact.alignment.heading, -1.0, 1e-12);
  EXPECT_GT(evaluate_aligned_path(truth, estimate).cartesian.mean, 100.0);
}

TEST(EvaluateAlignedPath, GivesTheErrorsThatNoAlignmentRemoves) {
  // A symmetric cross whose arms are 0.1 m too long: neither turn nor shift helps.
  std::vector<TruePose> truth;
  std::vector<EstimatedPose> estimate;
  for (int i = 0; i < 4; ++i) {
    const double c = std::cos(0.5 * kPi * i), s = std::sin(0.5 * kPi * i);
    truth.push_back({static_cast<double>(i), c, s, {}});
    EstimatedPose other;
    other.time = i;
    other.pose = {1.1 * c + 7.0, 1.1 * s, 0.0};
    estimate.push_back(other);
  }
  const AlignedPathErrors errors = evaluate_aligned_path(truth, estimate);
  EXPECT_NEAR(errors.cartesian.mean, 0.1, 1e-12);
  EXPECT_NEAR(errors.cartesian.median, 0.1, 1e-12);
  EXPECT_NEAR(errors.cartesian.std, 0.0, 1e-7);
  EXPECT_NEAR(errors.alignment.x, -7.0, 1e-12);
}

TEST(MatchById, TakesEachLandmarkOnce) {
  const auto matches =
      match_by_id({landmark(14, 0, 0), landmark(99, 0, 0), landmark(14, 4, 3)}, true_map());
  ASSERT_EQ(matches.size(), 1u);
  EXPECT_EQ(matches[0].estimated, 0u);
  EXPECT_EQ(matches[0].truth, 4u);
}

TEST(MatchByNearest, TakesTheNearestFirstAndEachOnce) {
  // Both estimates are nearest to the corner (0, 0); the farther has to be content with the middle.
  const std::vector<PointLandmark> estimated = {landmark(1, 1.8, 1.2), landmark(2, 0.1, 0.0)};
  auto matches = match_by_nearest(estimated, true_map(), 3.0);
  ASSERT_EQ(matches.size(), 2u);
  EXPECT_EQ(matches[0].truth, 4u);
  EXPECT_EQ(matches[1].truth, 0u);
  matches = match_by_nearest(estimated, true_map(), 2.0);
  ASSERT_EQ(matches.size(), 1u);
  EXPECT_EQ(matches[0].estimated, 1u);
}

TEST(UsualGate, IsHalfTheDistanceOfNeighbours) {
  EXPECT_NEAR(usual_gate(true_map()), 2.5, 1e-12);  // all are 5 m from the middle
  EXPECT_EQ(usual_gate({landmark(1, 0, 0), landmark(2, 0.2, 0)}), 0.5);
  EXPECT_EQ(usual_gate({landmark(1, 0, 0)}), 0.5);
}

TEST(EvaluateMap, GivesRawAndAlignedErrorsById) {
  // The whole map 0.3 and 0.4 m off: 0.5 m raw, nothing aligned. In another order, and one more.
  std::vector<PointLandmark> estimated;
  for (const PointLandmark& real : true_map()) {
    estimated.insert(estimated.begin(),
                     landmark(real.id, real.position.x() + 0.3, real.position.y() + 0.4));
  }
  estimated.push_back(landmark(77, 1.0, 1.0));
  const MapErrors errors = evaluate_map(estimated, true_map());
  EXPECT_EQ(errors.matching, LandmarkMatching::id);
  EXPECT_EQ(errors.landmarks, 6);
  EXPECT_EQ(errors.matched, 5);
  EXPECT_EQ(errors.false_landmarks, 1);
  EXPECT_EQ(errors.missed, 0);
  EXPECT_NEAR(*errors.rms, 0.5, 1e-12);
  EXPECT_NEAR(*errors.rms_aligned, 0.0, 1e-12);
  EXPECT_NEAR(errors.alignment.x, -0.3, 1e-12);
  EXPECT_FALSE(errors.coverage95.has_value());
}

TEST(EvaluateMap, MatchesByNearestInTheFrameThatIsFound) {
  // Ids that mean nothing, and a frame turned by 0.3 rad, which moves the far corner by 3 m: more
  // than the gate of 2.5 m.
  const Pose2 frame = {1.0, 0.5, 0.3};
  std::vector<PointLandmark> estimated = moved(true_map(), frame);
  for (std::size_t i = 0; i < estimated.size(); ++i) estimated[i].id = static_cast<int>(i);
  estimated.push_back(landmark(5, 50.0, 50.0));
  MapErrorOptions options;
  options.first_alignment = relative(frame, {});
  options.first_alignment.x += 0.5;  // roughly known, as from a path
  const MapErrors errors = evaluate_map(estimated, true_map(), options);
  EXPECT_EQ(errors.matching, LandmarkMatching::nearest);
  EXPECT_EQ(errors.matched, 5);
  EXPECT_EQ(errors.false_landmarks, 1);
  EXPECT_NEAR(*errors.rms_aligned, 0.0, 1e-12);
  // Raw: of each landmark, the distance that the frame moves it.
  double squares = 0.0;
  for (const PointLandmark& real : true_map()) {
    const double x = real.position.x(), y = real.position.y();
    const double dx = 1.0 + (std::cos(0.3) - 1.0) * x - std::sin(0.3) * y;
    const double dy = 0.5 + std::sin(0.3) * x + (std::cos(0.3) - 1.0) * y;
    squares += dx * dx + dy * dy;
  }
  EXPECT_NEAR(*errors.rms, std::sqrt(squares / 5.0), 1e-12);
}

TEST(EvaluateMap, DoesNotTrustIdsThatDoNotFit) {
  // Ids of true landmarks, each of the next one.
  std::vector<PointLandmark> estimated = true_map();
  for (std::size_t i = 0; i < 5; ++i) estimated[i].id = 10 + static_cast<int>((i + 2) % 5);
  const MapErrors errors = evaluate_map(estimated, true_map());
  EXPECT_EQ(errors.matching, LandmarkMatching::nearest);
  EXPECT_EQ(*errors.rms, 0.0);
  MapErrorOptions by_id;
  by_id.matching = LandmarkMatching::id;
  EXPECT_GT(*evaluate_map(estimated, true_map(), by_id).rms, 3.0);
}

TEST(EvaluateMap, ASecondLandmarkAtOnePlaceIsFalse) {
  std::vector<PointLandmark> estimated = true_map();
  for (std::size_t i = 0; i < 5; ++i) estimated[i].id = static_cast<int>(i);
  estimated.push_back(landmark(5, 4.2, 3.0));
  const MapErrors errors = evaluate_map(estimated, true_map());
  EXPECT_EQ(errors.matched, 5);
  EXPECT_EQ(errors.false_landmarks, 1);
}

TEST(EvaluateMap, ComparesErrorsWithCovariances) {
  // Off by 2, 2.4 and 2.5 sigma: 4 and 5.76 are below 5.991, 6.25 is above.
  std::vector<PointLandmark> estimated = {
      landmark(10, 0.2, 0.0, 0.01), landmark(11, 8.0, 0.24, 0.01), landmark(12, 8.25, 6.0, 0.01)};
  MapErrors errors = evaluate_map(estimated, true_map());
  EXPECT_NEAR(*errors.coverage95, 2.0 / 3.0, 1e-12);
  EXPECT_NEAR(*errors.normalized_error, (4.0 + 5.76 + 6.25) / 3.0, 1e-9);
  EXPECT_EQ(errors.missed, 2);
  // The truth's own uncertainty counts as well: half of each squared distance.
  std::vector<PointLandmark> surveyed = true_map();
  for (PointLandmark& real : surveyed) real.covariance = 0.01 * Eigen::Matrix2d::Identity();
  errors = evaluate_map(estimated, surveyed);
  EXPECT_EQ(*errors.coverage95, 1.0);
  EXPECT_NEAR(*errors.normalized_error, 0.5 * (4.0 + 5.76 + 6.25) / 3.0, 1e-9);
}

TEST(EvaluateMap, HasNoErrorsWithoutMatches) {
  const MapErrors nothing = evaluate_map({}, true_map());
  EXPECT_EQ(nothing.missed, 5);
  EXPECT_FALSE(nothing.rms.has_value());
  MapErrorOptions by_id;
  by_id.matching = LandmarkMatching::id;
  const MapErrors one = evaluate_map({landmark(10, 1, 0)}, true_map(), by_id);
  EXPECT_EQ(*one.rms, 1.0);
  EXPECT_FALSE(one.rms_aligned.has_value());
}

TEST(EvaluateMap, RefusesWhatCannotBeCompared) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(evaluate_map({landmark(1, nan, 0)}, true_map()), Error);
  EXPECT_THROW(evaluate_map(true_map(), {}), Error);
}

}  // namespace
}  // namespace pf_resampling
