#include "pf_resampling_core/filters/fastslam/smoothed_past.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

namespace pf_resampling {
namespace {

const SmoothingOptions kSmoothing{20, 4.0};
// As many landmarks as stand in a hall of 20 m by 20 m, seen from 10 m; a twentieth of what is seen
// is new.
const ReassociationOptions kReassociation{4.0, std::log(0.05 * 10.0 * 15.0 / 400.0),
                                          std::log(10.0 * 15.0 / 400.0)};
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
  SmoothedPast past;
  std::int64_t next_id = 100;
  std::map<std::pair<int, double>, int> seen;  // pose and range: which landmark it was

  Drive() { past.start(prior_at(Pose2{}, SensorConstants::Zero()), {}); }

  void move(double x, double y, double seconds = 1.0) {
    truth.x += x;
    truth.y += y;
    past.append(motion({x, y, 0.0}, seconds));
  }
  void see(int landmark, std::int64_t as, bool is_new = false) {
    const Eigen::Vector2d place = kLandmarks[static_cast<std::size_t>(landmark)];
    const Eigen::Vector2d from = place - Eigen::Vector2d(truth.x, truth.y);
    SightingFactor sighting;
    sighting.range = from.norm();
    sighting.bearing = std::atan2(from.y(), from.x());
    sighting.range_variance = 25e-4;
    sighting.bearing_variance = 25e-6;
    past.append_sighting(as, is_new, sighting);
    seen[{past.graph().sightings.back().pose, sighting.range}] = landmark;
  }
  void see_all(int updates) {
    for (int i = 0; i < updates; ++i) {
      move(0.1, 0.0);
      for (int l = 0; l < 5; ++l) see(l, l);
    }
  }
  SmoothingFault solve(const ReassociationOptions& reassociation = kReassociation) {
    return past.solve(kSmoothing, reassociation, &next_id).fault;
  }
  // Of the graph's landmarks: which ones its sightings really were of.
  std::map<int, std::set<int>> seen_as() const {
    std::map<int, std::set<int>> found;
    for (const SightingFactor& sighting : past.graph().sightings) {
      found[sighting.landmark].insert(seen.at({sighting.pose, sighting.range}));
    }
    return found;
  }
};

// After 20 s without a sighting the robot is 1 m beside where odometry has it, three times as far
// as that says it could be, and the first landmark seen looks like its neighbour: they are joined.
// What is seen next fits nothing then, but everything if the robot is where it is.
TEST(SmoothedPast, DecidesAnewWhatWasSeenSinceAnArrival) {
  Drive drive;
  drive.see_all(6);
  ASSERT_EQ(drive.solve(), SmoothingFault::none);
  drive.truth.y += 1.0;
  drive.past.append(motion({}, 20.0, 0.3));
  drive.see(1, 5, true);
  ASSERT_EQ(drive.solve(), SmoothingFault::none);
  // So far it is the likeliest that this is its neighbour, which it is not.
  ASSERT_EQ(drive.past.graph().landmarks.size(), 5u);
  ASSERT_EQ(drive.past.graph().sightings.back().landmark, drive.past.number_of(0));
  for (int i = 0; i < 4; ++i) {
    drive.move(0.1, 0.0);
    drive.see(1, 0);
    drive.see(2, 6, i == 0);
    drive.see(3, 7, i == 0);
  }
  ASSERT_EQ(drive.solve(), SmoothingFault::none);
  EXPECT_EQ(drive.past.graph().landmarks.size(), 5u);
  for (const auto& [landmark, of] : drive.seen_as()) EXPECT_EQ(of.size(), 1u) << landmark;
  // Ten standard deviations of four sightings across the line of sight, from 10 m.
  EXPECT_NEAR(drive.past.graph().poses.back().y, 1.0, 0.25);
}

// On a visit between whiles without a sighting, everything was taken for what stands 1 m beside it,
// long ago: two arrivals, and more than a minute. The visits since then show where the robot was.
TEST(SmoothedPast, ReconsidersVisitsOfThePast) {
  Drive drive;
  drive.see_all(6);
  drive.truth.y += 1.0;
  drive.past.append(motion({}, 20.0, 0.6));
  for (int i = 0; i < 5; ++i) {
    drive.move(0.1, 0.0);
    drive.see(1, 0);
    drive.see(2, 6, i == 0);
    drive.see(3, 7, i == 0);
  }
  for (int visit = 0; visit < 3; ++visit) {
    const double back = visit == 0 ? -1.0 : 0.0;
    drive.truth.y += back;
    drive.past.append(motion({0.0, back, 0.0}, 25.0, 0.6));
    drive.see_all(6);
  }
  SmoothedPastState state = drive.past.state();
  state.decided = static_cast<int>(state.graph.poses.size());
  drive.past.resume(state);
  for (int i = 0; i < 12; ++i) {
    drive.see_all(1);
    ASSERT_EQ(drive.solve(), SmoothingFault::none);
  }
  EXPECT_EQ(drive.past.graph().landmarks.size(), 5u);
  for (const auto& [landmark, of] : drive.seen_as()) EXPECT_EQ(of.size(), 1u) << landmark;
  EXPECT_NEAR(drive.past.graph().poses[9].y, 1.0, 0.25);
}

// A landmark that was seen as two, and in one scan as both: a false detection beside it. Its
// neighbour, 1 m away, stays.
TEST(SmoothedPast, DoesWithoutALandmarkThatAnotherExplains) {
  Drive drive;
  for (int i = 0; i < 20; ++i) {
    drive.move(0.1, 0.0);
    for (const int landmark : {0, 2, 3, 4}) drive.see(landmark, landmark);
    drive.see(1, i % 2 == 0 ? 1 : 9);
    if (i != 10) continue;
    SightingFactor beside = drive.past.graph().sightings.back();
    beside.range += 0.05;
    drive.past.append_sighting(9, false, beside);
    drive.seen[{beside.pose, beside.range}] = 1;
  }
  ASSERT_EQ(drive.past.graph().landmarks.size(), 6u);
  ASSERT_EQ(drive.solve(), SmoothingFault::none);
  EXPECT_EQ(drive.past.graph().landmarks.size(), 5u);
  EXPECT_EQ(drive.past.graph().unassigned.size(), 1u);
  for (const auto& [landmark, of] : drive.seen_as()) EXPECT_EQ(of.size(), 1u) << landmark;
}

// Two landmarks, 0.2 m apart: four standard deviations of a sighting. Two scans have seen both, and
// one the second as the first.
TEST(SmoothedPast, KeepsNeighboursThatAreTwo) {
  Drive drive;
  const Eigen::Vector2d neighbour = kLandmarks[1] + Eigen::Vector2d(0.0, 0.2);
  for (int i = 0; i < 8; ++i) {
    drive.move(0.1, 0.0);
    for (const int landmark : {0, 2, 3, 4}) drive.see(landmark, landmark);
    if (i < 4) drive.see(1, 1);
    if (i < 2) continue;
    SightingFactor other = drive.past.graph().sightings.back();
    const Eigen::Vector2d from = neighbour - Eigen::Vector2d(drive.truth.x, drive.truth.y);
    other.range = from.norm();
    other.bearing = std::atan2(from.y(), from.x());
    drive.past.append_sighting(i == 6 ? 1 : 9, i == 2, other);
    drive.seen[{other.pose, other.range}] = 9;
  }
  ASSERT_EQ(drive.solve(), SmoothingFault::none);
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
    drive.see(1, 1);
    SightingFactor other = drive.past.graph().sightings.back();
    const Eigen::Vector2d from = neighbour - Eigen::Vector2d(drive.truth.x, drive.truth.y);
    other.range = from.norm();
    other.bearing = std::atan2(from.y(), from.x());
    drive.past.append_sighting(8, i == 0, other);
    drive.seen[{other.pose, other.range}] = 8;
  }
  SmoothedPastState state = drive.past.state();
  const int another = static_cast<int>(state.graph.landmarks.size());
  state.graph.landmarks.push_back(kLandmarks[1] + Eigen::Vector2d(error, 0.0));
  state.landmark_ids.push_back(9);
  state.last_seen.push_back(30);
  state.is_dormant.push_back(false);
  for (SightingFactor& sighting : state.graph.sightings) {
    const int as =
        static_cast<int>(state.landmark_ids[static_cast<std::size_t>(sighting.landmark)]);
    if (as == 8 && sighting.pose == 20) sighting.landmark = drive.past.number_of(1);
    if (as != 1 || sighting.pose <= 10) continue;
    sighting.landmark = another;
    drive.seen[{sighting.pose, sighting.range + error}] = 1;
    sighting.range += error;
  }
  drive.past.resume(state);
  return drive;
}

// 2.5 standard deviations: were these errors independent, it would be sure that there is another
// landmark behind it (21 nats).
TEST(SmoothedPast, TakesAnErrorThatLastsForNoOtherLandmark) {
  Drive drive = drive_with_lasting_error(0.125);
  ASSERT_EQ(drive.solve(), SmoothingFault::none);
  EXPECT_EQ(drive.past.graph().landmarks.size(), 6u);
  for (const auto& [landmark, of] : drive.seen_as()) EXPECT_EQ(of.size(), 1u) << landmark;
}

// 4 standard deviations (53 nats): as one sighting they would say little, but no sensor errs so.
TEST(SmoothedPast, KeepsALandmarkThatManySightingsSpeakFor) {
  Drive drive = drive_with_lasting_error(0.2);
  ASSERT_EQ(drive.solve(), SmoothingFault::none);
  EXPECT_EQ(drive.past.graph().landmarks.size(), 7u);
}

// Each scan sees a hundred things that are never seen again. The belief about landmarks is dense,
// so they may not all be tried as landmarks: each that is takes an id.
TEST(SmoothedPast, TriesNoMoreLandmarksThanItMay) {
  Drive drive;
  ReassociationOptions few = kReassociation;
  few.most_landmarks = 7;
  drive.see_all(3);
  ASSERT_EQ(drive.solve(few), SmoothingFault::none);
  for (int i = 0; i < 5; ++i) {
    drive.move(0.1, 0.0);
    for (int l = 0; l < 5; ++l) drive.see(l, l);
    SightingFactor clutter = drive.past.graph().sightings.back();
    for (int k = 0; k < 100; ++k) {
      clutter.range = 20.0 + i + 7.0 * k;
      drive.past.append_unassigned(clutter);
    }
  }
  std::int64_t before = drive.next_id;
  ASSERT_EQ(drive.solve(few), SmoothingFault::none);
  EXPECT_EQ(drive.next_id, before);
  // Back in view after so long, each may be another.
  for (int i = 0; i < 3; ++i) {
    drive.move(0.1, 0.0, 20.0);
    for (int l = 0; l < 5; ++l) drive.see(l, l);
    before = drive.next_id;
    ASSERT_EQ(drive.solve(few), SmoothingFault::none);
    EXPECT_LE(drive.next_id, before + 2);
    EXPECT_EQ(drive.past.graph().landmarks.size(), 5u);
  }
}

TEST(SmoothedPast, KeepsLandmarksThatWereSeenOften) {
  Drive drive;
  drive.see_all(6);
  drive.move(0.1, 0.0);
  drive.see(0, 9, true);
  ASSERT_EQ(drive.solve(), SmoothingFault::none);
  const Eigen::Vector2d before = drive.past.graph().landmarks[4];
  drive.past.give_up_landmark(4);
  drive.past.give_up_landmark(77);  // of which it knows nothing
  ASSERT_EQ(drive.solve(), SmoothingFault::none);
  const int number = drive.past.number_of(4);
  ASSERT_GE(number, 0);
  EXPECT_TRUE(drive.past.state().is_dormant[static_cast<std::size_t>(number)]);
  EXPECT_NEAR((drive.past.graph().landmarks[static_cast<std::size_t>(number)] - before).norm(), 0.0,
              1e-3);
  // Seen again under another id, it is the same, and awake.
  for (int i = 0; i < 5; ++i) {
    drive.move(0.1, 0.0);
    for (int l = 0; l < 4; ++l) drive.see(l, l);
    drive.see(4, 50, i == 0);
  }
  ASSERT_EQ(drive.solve(), SmoothingFault::none);
  EXPECT_EQ(drive.past.number_of(50), -1);
  ASSERT_GE(drive.past.number_of(4), 0);
  EXPECT_FALSE(drive.past.state().is_dormant[static_cast<std::size_t>(drive.past.number_of(4))]);
}

TEST(SmoothedPast, ForgetsWhatWasSeenSeldom) {
  Drive drive;
  drive.see_all(4);
  drive.past.give_up_landmark(4);
  EXPECT_EQ(drive.past.number_of(4), -1);
  ASSERT_EQ(drive.solve(), SmoothingFault::none);
  // Four sightings are of nothing, unless they find another landmark.
  EXPECT_EQ(drive.past.graph().landmarks.size(), 4u);
  EXPECT_EQ(drive.past.graph().unassigned.size(), 4u);
}

// Once what saw it has left the window, there is nothing that could bring it back.
TEST(SmoothedPast, ForgetsDormantLandmarksWithTheirSightings) {
  Drive drive;
  drive.see_all(6);
  drive.past.give_up_landmark(4);
  for (int i = 0; i < 60; ++i) {
    drive.move(0.01, 0.0);
    for (int l = 0; l < 4; ++l) drive.see(l, l);
  }
  ASSERT_EQ(drive.solve(), SmoothingFault::none);
  ASSERT_GE(drive.past.number_of(4), 0);
  drive.past.bound(20, 4.0);
  EXPECT_EQ(drive.past.number_of(4), -1);
  ASSERT_EQ(drive.solve(), SmoothingFault::none);
  EXPECT_EQ(drive.past.graph().landmarks.size(), 4u);
}

}  // namespace
}  // namespace pf_resampling
