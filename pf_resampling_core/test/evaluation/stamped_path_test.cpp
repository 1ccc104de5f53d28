#include "pf_resampling_core/evaluation/stamped_path.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/says.hpp"

namespace pf_resampling {
namespace {

EstimatedPose estimated(double time, double x, double y, double heading, double variance = 0.0) {
  EstimatedPose pose;
  pose.time = time;
  pose.pose = {x, y, heading};
  pose.covariance = variance * Eigen::Matrix3d::Identity();
  return pose;
}

TEST(Interpolate, IsLinearInPositionAndCovariance) {
  const std::vector<EstimatedPose> path = {estimated(10.0, 1.0, -2.0, 0.2, 1.0),
                                           estimated(12.0, 5.0, 2.0, 0.6, 3.0)};
  const auto pose = interpolate(path, 10.5, 5.0);
  ASSERT_TRUE(pose);
  EXPECT_DOUBLE_EQ(pose->time, 10.5);
  EXPECT_DOUBLE_EQ(pose->pose.x, 2.0);
  EXPECT_DOUBLE_EQ(pose->pose.y, -1.0);
  EXPECT_DOUBLE_EQ(pose->pose.heading, 0.3);
  EXPECT_DOUBLE_EQ(pose->covariance(1, 1), 1.5);
}

TEST(Interpolate, TakesTheShorterArcOfTheHeading) {
  const std::vector<EstimatedPose> path = {estimated(0.0, 0.0, 0.0, kPi - 0.1),
                                           estimated(1.0, 0.0, 0.0, -kPi + 0.3)};
  // Over pi, by 0.4 rad: a quarter of it is at pi exactly, three quarters at -pi + 0.2.
  EXPECT_NEAR(std::abs(interpolate(path, 0.25, 2.0)->pose.heading), kPi, 1e-12);
  EXPECT_NEAR(interpolate(path, 0.75, 2.0)->pose.heading, -kPi + 0.2, 1e-12);
}

TEST(Interpolate, NeitherExtrapolatesNorBridgesGaps) {
  const std::vector<EstimatedPose> path = {
      estimated(0.0, 0.0, 0.0, 0.0), estimated(1.0, 1.0, 0.0, 0.0), estimated(4.0, 4.0, 0.0, 0.0)};
  EXPECT_FALSE(interpolate(path, -0.001, 2.0));
  EXPECT_FALSE(interpolate(path, 4.001, 2.0));
  EXPECT_FALSE(interpolate(path, 2.0, 2.0));
  EXPECT_TRUE(interpolate(path, 2.0, 3.0));
  // The poses themselves are there, whatever the gap beside them.
  EXPECT_DOUBLE_EQ(interpolate(path, 0.0, 2.0)->pose.x, 0.0);
  EXPECT_DOUBLE_EQ(interpolate(path, 1.0, 2.0)->pose.x, 1.0);
  EXPECT_DOUBLE_EQ(interpolate(path, 4.0, 2.0)->pose.x, 4.0);
}

TEST(Interpolate, GivesTheLastOfEqualStamps) {
  const std::vector<EstimatedPose> path = {
      estimated(0.0, 0.0, 0.0, 0.0), estimated(0.0, 7.0, 0.0, 0.0), estimated(1.0, 9.0, 0.0, 0.0)};
  EXPECT_DOUBLE_EQ(interpolate(path, 0.0, 2.0)->pose.x, 7.0);
  EXPECT_DOUBLE_EQ(interpolate(path, 0.5, 2.0)->pose.x, 8.0);
}

TEST(Interpolate, KnowsATrueHeadingOnlyBetweenTrueHeadings) {
  const std::vector<TruePose> path = {
      {0.0, 0.0, 0.0, 0.1}, {1.0, 2.0, 0.0, 0.3}, {2.0, 4.0, 0.0, {}}};
  EXPECT_NEAR(*interpolate(path, 0.5, 2.0)->heading, 0.2, 1e-12);
  const auto pose = interpolate(path, 1.5, 2.0);
  EXPECT_DOUBLE_EQ(pose->x, 3.0);
  EXPECT_FALSE(pose->heading);
}

TEST(UsualMaxGap, IsThreeMedianIntervalsButAtLeastASecond) {
  std::vector<TruePose> path;
  for (const double time : {0.0, 2.0, 4.0, 6.0, 100.0}) path.push_back({time, 0.0, 0.0, {}});
  EXPECT_DOUBLE_EQ(usual_max_gap(path), 6.0);
  path = {{0.0, 0.0, 0.0, {}}, {0.1, 0.0, 0.0, {}}};
  EXPECT_DOUBLE_EQ(usual_max_gap(path), 1.0);
}

TEST(CheckPath, NamesThePoseThatIsWrong) {
  const auto message = [](const std::vector<TruePose>& path) -> std::string {
    return refusal([&] { check_path(path, "ground truth"); });
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(message({{0.0, 1.0, 2.0, {}}, {0.0, 1.0, 2.0, 0.5}}), "");
  EXPECT_TRUE(says(message({}), "ground truth is empty"));
  EXPECT_TRUE(says(message({{0.0, 1.0, 2.0, {}}, {1.0, nan, 2.0, {}}}), "pose 2 of 2"));
  EXPECT_TRUE(says(message({{0.0, 1.0, 2.0, nan}}), "not finite"));
  EXPECT_TRUE(says(message({{1.0, 1.0, 2.0, {}}, {0.5, 1.0, 2.0, {}}}), "back in time"));
}

TEST(TrackDirections, AreTheTrueHeadingsWhereKnown) {
  const auto directions = track_directions({{0.0, 0.0, 0.0, 1.0}, {1.0, 1.0, 0.0, -2.0}});
  EXPECT_DOUBLE_EQ(*directions[0], 1.0);
  EXPECT_DOUBLE_EQ(*directions[1], -2.0);
}

TEST(TrackDirections, FollowACircleWithoutHeadings) {
  std::vector<TruePose> truth;
  const double radius = 5.0;
  for (int i = 0; i <= 2000; ++i) {
    const double angle = 2.0 * kPi * i / 2000.0;
    truth.push_back({0.1 * i, radius * std::cos(angle), radius * std::sin(angle), {}});
  }
  const auto directions = track_directions(truth);
  // Chords of 2 % of the diagonal turn by 0.057 rad: away from the ends the interpolated direction
  // is right to the step of the truth (0.003 rad), at the ends to one chord and a half.
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double tangent = 2.0 * kPi * static_cast<double>(i) / 2000.0 + 0.5 * kPi;
    const bool is_end = i < 30 || i + 30 > truth.size();
    ASSERT_TRUE(directions[i]);
    EXPECT_NEAR(wrap_angle(*directions[i] - tangent), 0.0, is_end ? 0.09 : 0.004) << i;
  }
}

TEST(TrackDirections, HoldWhileTheRobotStandsInANoisyReference) {
  std::vector<TruePose> truth;
  for (int i = 0; i < 100; ++i) truth.push_back({0.1 * i, 0.1 * i, 0.0, {}});
  for (int i = 100; i < 200; ++i) {
    truth.push_back({0.1 * i, 10.0 + 0.01 * ((i % 3) - 1), 0.01 * ((i % 5) - 2), {}});
  }
  const auto directions = track_directions(truth);
  for (std::size_t i = 0; i < truth.size(); ++i) EXPECT_NEAR(*directions[i], 0.0, 0.1) << i;
}

TEST(TrackDirections, DoNotExistIfTheTruthNeverMoves) {
  const auto directions = track_directions({{0.0, 1.0, 1.0, {}}, {1.0, 1.0, 1.0, {}}});
  EXPECT_FALSE(directions[0]);
  EXPECT_FALSE(directions[1]);
}

// Odometry of a drive, seen from a frame in which the drive starts elsewhere, and in which it is
// turned by -1.2 rad: alignment has to undo that.
std::vector<EstimatedPose> seen_from_elsewhere(const std::vector<TruePose>& truth,
                                               double heading_offset) {
  const Pose2 frame = {3.0, -4.0, 1.2};
  std::vector<EstimatedPose> odometry;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const TruePose& next = truth[std::min(i + 1, truth.size() - 1)];
    const TruePose& last = truth[i + 1 < truth.size() ? i : i - 1];
    const double heading = std::atan2(next.y - last.y, next.x - last.x) + heading_offset;
    EstimatedPose pose;
    pose.time = truth[i].time;
    pose.pose = relative(frame, {truth[i].x, truth[i].y, heading});
    odometry.push_back(pose);
  }
  return odometry;
}

std::vector<TruePose> curved_drive(bool with_heading) {
  std::vector<TruePose> truth;
  for (int i = 0; i < 400; ++i) {
    const double s = 0.05 * i;
    TruePose pose = {0.1 * i, 7.0 + s, 2.0 + 0.1 * s * s, {}};
    if (with_heading) {
      const double next = s + 0.05;
      pose.heading = std::atan2(0.1 * (next * next - s * s), 0.05);
    }
    truth.push_back(pose);
  }
  return truth;
}

TEST(AlignAtStart, PutsOdometryOnTheFirstTruePose) {
  const std::vector<TruePose> truth = curved_drive(true);
  const auto aligned = align_at_start(seen_from_elsewhere(truth, 0.0), truth);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_NEAR(aligned[i].pose.x, truth[i].x, 1e-9);
    EXPECT_NEAR(aligned[i].pose.y, truth[i].y, 1e-9);
  }
  EXPECT_NEAR(aligned[0].pose.heading, *truth[0].heading, 1e-9);
}

TEST(AlignAtStart, FindsTheDirectionFromTheFirstPartWithoutHeading) {
  const std::vector<TruePose> truth = curved_drive(false);
  // The robot may even drive sideways: positions alone decide.
  const auto aligned = align_at_start(seen_from_elsewhere(truth, 0.7), truth);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_NEAR(aligned[i].pose.x, truth[i].x, 1e-9);
    EXPECT_NEAR(aligned[i].pose.y, truth[i].y, 1e-9);
  }
}

TEST(AlignAtStart, UsesOnlyTheFirstTenPercentForTheDirection) {
  const std::vector<TruePose> truth = curved_drive(false);
  std::vector<EstimatedPose> odometry = seen_from_elsewhere(truth, 0.0);
  for (std::size_t i = odometry.size() / 2; i < odometry.size(); ++i) odometry[i].pose.x += 100.0;
  const auto aligned = align_at_start(odometry, truth);
  EXPECT_NEAR(aligned[100].pose.x, truth[100].x, 1e-9);
  EXPECT_NEAR(aligned[100].pose.y, truth[100].y, 1e-9);
}

TEST(AlignAtStart, StartsWhereOdometryBegins) {
  const std::vector<TruePose> truth = curved_drive(true);
  std::vector<EstimatedPose> odometry = seen_from_elsewhere(truth, 0.0);
  odometry.erase(odometry.begin(), odometry.begin() + 50);
  const auto aligned = align_at_start(odometry, truth);
  EXPECT_NEAR(aligned[0].pose.x, truth[50].x, 1e-9);
  EXPECT_NEAR(aligned[300].pose.y, truth[350].y, 1e-9);
}

TEST(AlignAtStart, SaysWhenTheClocksDoNotMeet) {
  const std::vector<TruePose> truth = curved_drive(true);
  std::vector<EstimatedPose> odometry = seen_from_elsewhere(truth, 0.0);
  for (EstimatedPose& pose : odometry) pose.time += 1000.0;
  EXPECT_THROW(align_at_start(odometry, truth), Error);
}

// Heading pi/2: the antenna, 2 m ahead and 1 m to the right, is at (1, 2) from the robot; a turn by
// one radian moves it by (-2, 1).
TEST(StampedPath, TheErrorsOfTheHeadingMoveWhatSitsOnTheRobot) {
  EstimatedPose robot;
  robot.pose = {10.0, 20.0, 0.5 * kPi};
  robot.covariance = Eigen::Vector3d(0.1, 0.2, 0.3).asDiagonal();
  const EstimatedPose antenna = path_of_place({robot}, {2.0, -1.0, 0.0}).front();
  EXPECT_NEAR(antenna.pose.x, 11.0, 1e-12);
  EXPECT_NEAR(antenna.pose.y, 22.0, 1e-12);
  EXPECT_NEAR(antenna.pose.heading, 0.5 * kPi, 1e-12);
  EXPECT_NEAR(antenna.covariance(0, 0), 0.1 + 4.0 * 0.3, 1e-12);
  EXPECT_NEAR(antenna.covariance(1, 1), 0.2 + 1.0 * 0.3, 1e-12);
  EXPECT_NEAR(antenna.covariance(0, 1), -2.0 * 0.3, 1e-12);
  EXPECT_NEAR(antenna.covariance(0, 2), -2.0 * 0.3, 1e-12);
}

}  // namespace
}  // namespace pf_resampling
