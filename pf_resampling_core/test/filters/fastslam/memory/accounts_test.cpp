#include "pf_resampling_core/filters/fastslam/memory/accounts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "pf_resampling_core/filters/fastslam/memory/memory.hpp"

namespace pf_resampling {
namespace {

// As many landmarks as stand in a hall of 20 m by 20 m, seen from 10 m; a twentieth of what is seen
// is new.
const ReassociationOptions kReassociation{4.0, std::log(0.05 * 10.0 * 15.0 / 400.0),
                                          std::log(10.0 * 15.0 / 400.0), 1000};
const std::vector<Eigen::Vector2d> kLandmarks = {
    {10.0, 0.0}, {10.0, 1.0}, {14.0, 2.5}, {13.0, -2.0}, {8.0, -3.0}};

MotionFactor motion(const Pose2& mean, double seconds, double sigma_of_y = 0.01) {
  MotionFactor factor;
  factor.mean = mean;
  factor.covariance.diagonal() << 1e-4, sigma_of_y * sigma_of_y, 1e-6;
  factor.sensitivity(2, SensorConstant::yaw_rate) = seconds;
  return factor;
}

// Drives through the hall and sees what it is told to, exactly.
struct Drive {
  Pose2 truth;
  Memory past;
  std::int64_t next_id = 100;
  std::map<std::pair<int, double>, int> seen;  // pose and range: which landmark it was

  Drive() { past.start(Pose2{}, SensorConstants::Zero()); }

  void move(double x, double y, double seconds = 1.0) {
    truth.x += x;
    truth.y += y;
    past.append(motion({x, y, 0.0}, seconds));
  }
  SightingFactor sighting_of(const Eigen::Vector2d& place) const {
    const Eigen::Vector2d from = place - Eigen::Vector2d(truth.x, truth.y);
    SightingFactor sighting;
    sighting.range = from.norm();
    sighting.bearing = std::atan2(from.y(), from.x());
    sighting.range_variance = 25e-4;
    sighting.bearing_variance = 25e-6;
    return sighting;
  }
  void see(int landmark, std::int64_t as) {
    see(landmark, as, sighting_of(kLandmarks[static_cast<std::size_t>(landmark)]));
  }
  void see(int landmark, std::int64_t as, const SightingFactor& sighting) {
    past.append_sighting(as, sighting);
    seen[{static_cast<int>(past.updates()) - 1, sighting.range}] = landmark;
  }
  void see_all(int updates) {
    for (int i = 0; i < updates; ++i) {
      move(0.1, 0.0);
      for (int l = 0; l < 5; ++l) see(l, l);
    }
  }
  bool solve(const ReassociationOptions& reassociation = kReassociation) {
    return past.solve(reassociation, &next_id);
  }
  int landmark_of_last_sighting() const {
    int last = -1;
    for_each_sighting(past.graph(), past.state().begins,
                      [&](int, double, const SightingFactor&, int landmark) { last = landmark; });
    return last;
  }
  std::size_t unassigned() const {
    std::size_t count = 0;
    for (const auto& segment : past.graph().segments) count += segment->unassigned.size();
    return count;
  }
  // Of the graph's landmarks: which ones its sightings really were of.
  std::map<int, std::set<int>> seen_as() const {
    std::map<int, std::set<int>> found;
    for_each_sighting(past.graph(), past.state().begins,
                      [&](int update, double, const SightingFactor& sighting, int landmark) {
                        found[landmark].insert(seen.at({update, sighting.range}));
                      });
    return found;
  }
};

// Where none is sure, as each has a neighbour one standard deviation farther away, draws are half
// as wide again as the Gaussian.
TEST(Accounts, DrawsAreWiderWhereLandmarksAreHardToTellApart) {
  Drive drive;
  for (int i = 0; i < 6; ++i) {
    drive.move(0.1, 0.0);
    for (const int beside : {0, 1}) {
      for (int l : {2, 3, 4}) {
        SightingFactor sighting = drive.sighting_of(kLandmarks[static_cast<std::size_t>(l)]);
        sighting.range += 0.05 * beside;
        drive.see(l, l + 10 * beside, sighting);
      }
    }
  }
  ASSERT_TRUE(drive.solve());
  SegmentGraph graph = drive.past.graph();
  ASSERT_EQ(graph.landmarks.size(), 6u);
  std::unique_ptr<SegmentEquations> equations;
  ASSERT_TRUE(solve(kReassociation.robust_width, &graph, &equations).is_solved);
  const RandomStream stream(1, RandomPurpose::test, 0);
  const double of_gaussian = draw_deviations(*equations, graph, 100, stream).norm();
  EXPECT_NEAR(drive.past.draw(100, stream).deviations.norm(), 1.5 * of_gaussian,
              0.01 * of_gaussian);
}

// After 20 s without a sighting the robot is 1 m beside where odometry has it, three times as far
// as that says it could be, and the first landmark seen looks like its neighbour: they are joined.
// What is seen next fits nothing then, but everything if the robot is where it is.
TEST(Accounts, DecidesAnewWhatWasSeenSinceAnArrival) {
  Drive drive;
  drive.see_all(6);
  ASSERT_TRUE(drive.solve());
  drive.truth.y += 1.0;
  drive.past.append(motion({}, 20.0, 0.3));
  drive.see(1, 5);
  ASSERT_TRUE(drive.solve());
  // So far it is the likeliest that this is its neighbour, which it is not.
  ASSERT_EQ(drive.past.graph().landmarks.size(), 5u);
  ASSERT_EQ(drive.landmark_of_last_sighting(), drive.past.number_of(0));
  for (int i = 0; i < 4; ++i) {
    drive.move(0.1, 0.0);
    drive.see(1, 0);
    drive.see(2, 6);
    drive.see(3, 7);
  }
  ASSERT_TRUE(drive.solve());
  EXPECT_EQ(drive.past.graph().landmarks.size(), 5u);
  for (const auto& [landmark, of] : drive.seen_as()) EXPECT_EQ(of.size(), 1u) << landmark;
  // Ten standard deviations of four sightings across the line of sight, from 10 m.
  EXPECT_NEAR(drive.past.graph().newest().y, 1.0, 0.25);
}

// A landmark that was seen as two, and in one scan as both: a false detection beside it. Its
// neighbour, 1 m away, stays.
TEST(Accounts, DoesWithoutALandmarkThatAnotherExplains) {
  Drive drive;
  for (int i = 0; i < 20; ++i) {
    drive.move(0.1, 0.0);
    for (const int landmark : {0, 2, 3, 4}) drive.see(landmark, landmark);
    drive.see(1, i % 2 == 0 ? 1 : 9);
    if (i != 10) continue;
    SightingFactor beside = drive.sighting_of(kLandmarks[1]);
    beside.range += 0.05;
    drive.see(1, 9, beside);
  }
  ASSERT_TRUE(drive.solve());
  EXPECT_EQ(drive.past.graph().landmarks.size(), 5u);
  EXPECT_EQ(drive.unassigned(), 1u);
  for (const auto& [landmark, of] : drive.seen_as()) EXPECT_EQ(of.size(), 1u) << landmark;
}

// Two landmarks, 0.2 m apart: four standard deviations of a sighting. Two scans have seen both, and
// one the second as the first.
TEST(Accounts, KeepsNeighboursThatAreTwo) {
  Drive drive;
  const Eigen::Vector2d neighbour = kLandmarks[1] + Eigen::Vector2d(0.0, 0.2);
  for (int i = 0; i < 8; ++i) {
    drive.move(0.1, 0.0);
    for (const int landmark : {0, 2, 3, 4}) drive.see(landmark, landmark);
    if (i < 4) drive.see(1, 1);
    if (i < 2) continue;
    drive.see(9, i == 6 ? 1 : 9, drive.sighting_of(neighbour));
  }
  ASSERT_TRUE(drive.solve());
  EXPECT_EQ(drive.past.graph().landmarks.size(), 6u);
  for (const auto& [landmark, of] : drive.seen_as()) EXPECT_EQ(of.size(), 1u) << landmark;
}

// Of a landmark's thirty sightings the last twenty are too far away by `error` (m) and taken for
// another landmark's. A scan has seen both, as it took the neighbour, 0.2 m away, for the first.
Drive drive_with_lasting_error(double error) {
  Drive drive;
  const Eigen::Vector2d neighbour = kLandmarks[1] + Eigen::Vector2d(0.0, 0.2);
  for (int i = 0; i < 30; ++i) {
    drive.move(0.02, 0.0);
    for (const int landmark : {0, 2, 3, 4}) drive.see(landmark, landmark);
    SightingFactor first = drive.sighting_of(kLandmarks[1]);
    if (i >= 10) first.range += error;
    drive.see(1, i < 10 ? 1 : 9, first);
    drive.see(8, i == 19 ? 1 : 8, drive.sighting_of(neighbour));
  }
  return drive;
}

// 2.5 standard deviations: were these errors independent, it would be sure that there is another
// landmark behind it (21 nats).
TEST(Accounts, TakesAnErrorThatLastsForNoOtherLandmark) {
  Drive drive = drive_with_lasting_error(0.125);
  ASSERT_TRUE(drive.solve());
  EXPECT_EQ(drive.past.graph().landmarks.size(), 6u);
  for (const auto& [landmark, of] : drive.seen_as()) EXPECT_EQ(of.size(), 1u) << landmark;
}

// 4 standard deviations (53 nats): as one sighting they would say little, but no sensor errs so.
TEST(Accounts, KeepsALandmarkThatManySightingsSpeakFor) {
  Drive drive = drive_with_lasting_error(0.2);
  ASSERT_TRUE(drive.solve());
  EXPECT_EQ(drive.past.graph().landmarks.size(), 7u);
}

// Each scan sees a hundred things that are never seen again. The belief about landmarks is dense,
// so they may not all be tried as landmarks: each that is takes an id.
TEST(Accounts, TriesNoMoreLandmarksThanItMay) {
  Drive drive;
  ReassociationOptions few = kReassociation;
  few.most_landmarks = 7;
  drive.see_all(3);
  ASSERT_TRUE(drive.solve(few));
  for (int i = 0; i < 5; ++i) {
    drive.move(0.1, 0.0);
    for (int l = 0; l < 5; ++l) drive.see(l, l);
    SightingFactor clutter = drive.sighting_of(kLandmarks[4]);
    for (int k = 0; k < 100; ++k) {
      clutter.range = 20.0 + i + 7.0 * k;
      drive.past.append_unassigned(clutter);
    }
  }
  std::int64_t before = drive.next_id;
  ASSERT_TRUE(drive.solve(few));
  EXPECT_EQ(drive.next_id, before);
  // Back in view after so long, each may be another.
  for (int i = 0; i < 3; ++i) {
    drive.move(0.1, 0.0, 20.0);
    for (int l = 0; l < 5; ++l) drive.see(l, l);
    before = drive.next_id;
    ASSERT_TRUE(drive.solve(few));
    EXPECT_LE(drive.next_id, before + 2);
    EXPECT_EQ(drive.past.graph().landmarks.size(), 5u);
  }
}

TEST(Accounts, KeepsLandmarksThatWereSeenOften) {
  Drive drive;
  drive.see_all(6);
  drive.move(0.1, 0.0);
  drive.see(0, 9);
  ASSERT_TRUE(drive.solve());
  const Eigen::Vector2d before = drive.past.graph().landmarks[4];
  drive.past.give_up_landmark(4);
  drive.past.give_up_landmark(77);  // of which it knows nothing
  ASSERT_TRUE(drive.solve());
  const int number = drive.past.number_of(4);
  ASSERT_GE(number, 0);
  EXPECT_TRUE(drive.past.state().landmarks[static_cast<std::size_t>(number)].is_dormant);
  EXPECT_NEAR((drive.past.graph().landmarks[static_cast<std::size_t>(number)] - before).norm(), 0.0,
              1e-3);
  // Seen again under another id, it is the same, and awake.
  for (int i = 0; i < 5; ++i) {
    drive.move(0.1, 0.0);
    for (int l = 0; l < 4; ++l) drive.see(l, l);
    drive.see(4, 50);
  }
  ASSERT_TRUE(drive.solve());
  EXPECT_EQ(drive.past.number_of(50), -1);
  const int anew = drive.past.number_of(4);
  ASSERT_GE(anew, 0);
  EXPECT_FALSE(drive.past.state().landmarks[static_cast<std::size_t>(anew)].is_dormant);
}

// Seventy metres of a row of landmarks, then back to its begin by odometry that may be 2 m off:
// what is seen there fits the first without any error, though it was taken for the third.
TEST(Accounts, WhatComesBackIntoViewOfALargeMapMayBeAnother) {
  Drive drive;
  const auto place = [](int landmark) {
    return Eigen::Vector2d(landmark + 2.0, landmark % 2 == 0 ? 3.0 : -3.0);
  };
  for (int i = 0; i < 70; ++i) {
    drive.move(1.0, 0.0);
    for (const int l : {i, i + 1}) drive.see(l, l, drive.sighting_of(place(l)));
  }
  ASSERT_TRUE(drive.solve());
  ASSERT_EQ(drive.landmark_of_last_sighting(), drive.past.number_of(70));
  drive.truth.x -= 69.0;
  MotionFactor back = motion({-69.0, 0.0, 0.0}, 20.0, 2.0);
  back.covariance(0, 0) = 4.0;
  drive.past.append(back);
  drive.see(0, 2, drive.sighting_of(place(0)));
  ASSERT_TRUE(drive.solve());
  EXPECT_EQ(drive.landmark_of_last_sighting(), drive.past.number_of(0));
}

// Past landmarks on the left, with a sensor that sees them from 6 m, 1.2 rad to either side. A poor
// one sees every third landmark in one scan of four.
void drive_past(const std::vector<Eigen::Vector2d>& landmarks, std::int64_t first_id, Drive* drive,
                bool is_poor = false) {
  for (int i = 0; i < 40; ++i) {
    drive->move(0.5, 0.0);
    for (std::size_t l = 0; l < landmarks.size(); ++l) {
      const SightingFactor sighting = drive->sighting_of(landmarks[l]);
      if (sighting.range > 6.0 || std::abs(sighting.bearing) > 1.2) continue;
      if (is_poor && l % 3 == 1 && i % 4 != 0) continue;
      drive->see(static_cast<int>(first_id) + static_cast<int>(l),
                 first_id + static_cast<std::int64_t>(l), sighting);
    }
  }
}

// Through an aisle, then by odometry 8 m beside its begin, which may be off by 4 m, and through an
// aisle again. It is the first one, if all that stands there is seen. If four of five are missing,
// it is another: all that is seen fits the first, but the others would have been seen.
TEST(Accounts, AnAisleLikeAnotherIsAnother) {
  std::vector<Eigen::Vector2d> all, every_fifth;
  for (int i = 0; i < 20; ++i) all.emplace_back(i + 3.0, 3.0);
  for (std::size_t i = 0; i < all.size(); i += 5) {
    every_fifth.emplace_back(all[i] + Eigen::Vector2d(0.0, 8.0));
  }
  for (const bool is_back : {true, false}) {
    Drive drive;
    drive_past(all, 0, &drive);
    ASSERT_TRUE(drive.solve());
    drive.truth = {0.0, is_back ? 0.0 : 8.0, 0.0};
    drive.past.append(motion({-20.0, 8.0, 0.0}, 20.0, 4.0));
    drive_past(is_back ? all : every_fifth, 50, &drive);
    ASSERT_TRUE(drive.solve());
    EXPECT_NEAR(drive.past.graph().newest().y, drive.truth.y, 0.1);
    EXPECT_FALSE(drive.past.misses_landmarks());
    const auto& landmarks = drive.past.state().landmarks;
    EXPECT_EQ(std::count_if(landmarks.begin(), landmarks.end(),
                            [](const RememberedLandmark& landmark) { return landmark.id >= 0; }),
              is_back ? 20 : 24);
  }
}

// The same, but odometry is sure that the robot is back in the first aisle: all that is seen fits,
// and only what is missing tells.
TEST(Accounts, TellsByWhatIsMissedThatTheRobotIsElsewhere) {
  std::vector<Eigen::Vector2d> all, every_second;
  for (int i = 0; i < 20; ++i) all.emplace_back(i + 3.0, 3.0);
  for (std::size_t i = 0; i < all.size(); i += 2) {
    every_second.emplace_back(all[i] + Eigen::Vector2d(0.0, 8.0));
  }
  for (const bool is_poor : {false, true}) {
    Drive drive;
    drive_past(all, 0, &drive, is_poor);
    ASSERT_TRUE(drive.solve());
    EXPECT_FALSE(drive.past.misses_landmarks());
    drive.truth = {0.0, 8.0, 0.0};
    drive.past.append(motion({-20.0, 0.0, 0.0}, 20.0, 0.01));
    drive_past(every_second, 50, &drive, is_poor);
    ASSERT_TRUE(drive.solve());
    EXPECT_TRUE(drive.past.misses_landmarks());
    Memory resumed;
    resumed.resume(drive.past.state());
    EXPECT_TRUE(resumed.misses_landmarks());
  }
}

// A driver gone mad: no cost is finite. The memory begins anew, not for ever in vain.
TEST(Accounts, WhatCannotBeSolvedForLongIsForgotten) {
  Drive drive;
  drive.see_all(6);
  ASSERT_TRUE(drive.solve());
  drive.past.append(motion({1e200, 0.0, 0.0}, 1.0));
  drive.see_all(400);
  EXPECT_FALSE(drive.solve());
  EXPECT_FALSE(drive.past.is_empty());
  drive.see_all(150);
  EXPECT_FALSE(drive.solve());
  EXPECT_TRUE(drive.past.is_empty());
}

TEST(Accounts, ForgetsWhatWasSeenSeldom) {
  Drive drive;
  drive.see_all(4);
  drive.past.give_up_landmark(4);
  ASSERT_TRUE(drive.solve());
  EXPECT_EQ(drive.past.number_of(4), -1);
  // Four sightings are of nothing, unless they find another landmark.
  EXPECT_EQ(drive.past.graph().landmarks.size(), 4u);
  EXPECT_EQ(drive.unassigned(), 4u);
}

}  // namespace
}  // namespace pf_resampling
