#include "pf_resampling_core/filters/fastslam/global_search.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pf_resampling_core/models/point_alignment.hpp"
#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

LandmarkEstimate landmark(std::int64_t id, double x, double y) {
  LandmarkEstimate landmark;
  landmark.id = id;
  landmark.mean = {x, y};
  landmark.covariance = 1e-4 * Eigen::Matrix2d::Identity();
  return landmark;
}

/// No two distances are alike.
std::vector<LandmarkEstimate> odd_map() {
  return {landmark(1, 0.0, 0.0),  landmark(2, 7.0, 1.0),  landmark(3, 3.0, 5.5),
          landmark(4, -4.0, 3.0), landmark(5, 1.0, -6.0), landmark(6, 9.5, -4.0)};
}

/// Where the landmarks are seen from `robot`, in its frame.
std::vector<SeenPlace> seen_from(const Pose2& robot, const std::vector<LandmarkEstimate>& map) {
  std::vector<SeenPlace> places;
  for (const LandmarkEstimate& one : map) {
    places.push_back({moved(one.mean, relative(robot, Pose2{})), 0.05, 3});
  }
  return places;
}

// A second place fits all five within the gate, but two sigmas off in the mean: by chance once in
// ten thousand times.
TEST(MatchPlaces, APlaceThatFitsMuchWorseIsNoRival) {
  const std::vector<LandmarkEstimate> map = {landmark(1, -5.5, -1.0), landmark(2, -2.0, 4.2),
                                             landmark(3, 3.0, 3.8),   landmark(4, 5.8, 0.5),
                                             landmark(5, 2.5, -4.0),  landmark(6, -2.5, -3.8),
                                             landmark(7, 0.3, 0.6),   landmark(8, -1.0, -1.2)};
  std::vector<SeenPlace> places = seen_from({1.0, 2.0, 0.5}, {map.begin() + 1, map.begin() + 6});
  for (SeenPlace& place : places) place.sigma = 0.15;
  const PlaceMatch match = match_places(places, map);
  EXPECT_FALSE(match.is_ambiguous);
  EXPECT_EQ(match.landmarks, (std::vector<int>{1, 2, 3, 4, 5}));
}

RangeBearingObservation observed(const Pose2& robot, const LandmarkEstimate& mark, int id) {
  const Eigen::Vector2d offset = mark.mean - Eigen::Vector2d(robot.x, robot.y);
  return {id, offset.norm(), wrap_angle(std::atan2(offset.y(), offset.x()) - robot.heading), 1e-4,
          1e-4};
}

TEST(GlobalSearch, MatchesPlacesToLandmarksWhateverTheirOrder) {
  const auto map = odd_map();
  auto places = seen_from({3.0, -1.0, 2.0}, map);
  std::swap(places[0], places[4]);
  places.push_back({{40.0, 0.0}, 0.05, 3});  // something that is not in the map
  const auto matched = match_places(places, map);
  EXPECT_EQ(matched.landmarks, (std::vector<int>{4, 1, 2, 3, 0, 5, -1}));
}

// What was seen often decides: all of it, not how many landmarks that was.
TEST(GlobalSearch, TellsPlacesApartByTheirSightings) {
  // Five landmarks lie alike twice; two more at different distances from them.
  std::vector<LandmarkEstimate> map;
  const std::vector<Eigen::Vector2d> shape = {{0, 0}, {4, 1}, {1, 5}, {6, 6}, {-3, 4}};
  for (const double shift : {0.0, 40.0}) {
    for (const Eigen::Vector2d& at : shape) {
      map.push_back(landmark(static_cast<int>(map.size()), at.x() + shift, at.y()));
    }
  }
  map.push_back(landmark(10, 2.0, 9.0));
  auto places = seen_from({1.0, 2.0, 0.3}, {map[0], map[1], map[2], map[3], map[4], map[10]});
  EXPECT_TRUE(match_places(places, map).is_ambiguous);
  places.back().sightings = 30;
  EXPECT_EQ(match_places(places, map).landmarks, (std::vector<int>{0, 1, 2, 3, 4, 10}));
}

// Odometry drifts: what was seen before and after may be apart.
TEST(GlobalSearch, TheSameLandmarkMayHaveBeenSeenAtTwoPlaces) {
  const auto map = odd_map();
  auto places = seen_from({3.0, -1.0, 2.0}, map);
  places.insert(places.begin(), places[0]);
  places[0].place.x() += 0.1;
  EXPECT_EQ(match_places(places, map).landmarks, (std::vector<int>{0, 0, 1, 2, 3, 4, 5}));
}

TEST(GlobalSearch, SaysNothingWhereTwoPlacesFit) {
  // A square looks the same from four sides.
  const std::vector<LandmarkEstimate> square = {landmark(1, 0.0, 0.0), landmark(2, 10.0, 0.0),
                                                landmark(3, 10.0, 10.0), landmark(4, 0.0, 10.0)};
  const auto matched = match_places(seen_from({3.0, 2.0, 0.5}, square), square);
  EXPECT_TRUE(matched.landmarks.empty());
  EXPECT_TRUE(matched.is_ambiguous);
  // Too few, and what is not in the map at all.
  const auto map = odd_map();
  const std::vector<SeenPlace> elsewhere = {
      {{0.0, 0.0}, 0.05, 3}, {{0.5, 0.0}, 0.05, 3}, {{0.0, 0.7}, 0.05, 3}, {{0.9, 0.9}, 0.05, 3}};
  for (const auto& places : {seen_from({}, {map[0], map[1], map[2]}), elsewhere}) {
    const auto none = match_places(places, map);
    EXPECT_TRUE(none.landmarks.empty());
    EXPECT_FALSE(none.is_ambiguous);
  }
}

// The robot drives 1 m between scans; each shows two of the landmarks.
TEST(GlobalSearch, FindsTheRobotByWhatItSawOnItsWay) {
  const auto map = odd_map();
  for (const bool with_ids : {true, false}) {
    GlobalSearch search;
    Pose2 robot = {2.0, -3.0, 1.0};
    const Pose2 motion = {1.0, 0.0, 0.1};
    std::optional<PoseEstimate> found;
    for (int scan = 0; scan < 9 && !found; ++scan) {
      std::vector<RangeBearingObservation> observations;
      for (const int k : {scan % 6, (scan + 1) % 6}) {
        const auto& mark = map[static_cast<std::size_t>(k)];
        observations.push_back(observed(robot, mark, with_ids ? static_cast<int>(mark.id) : -1));
      }
      found = search.add(1'000'000'000LL * scan, observations, {}, {}, map, with_ids);
      if (found) break;
      search.move(motion);
      robot = compose(robot, motion);
    }
    ASSERT_TRUE(found) << with_ids;
    EXPECT_NEAR(found->mean.x, robot.x, 1e-6);
    EXPECT_NEAR(found->mean.y, robot.y, 1e-6);
    EXPECT_NEAR(wrap_angle(found->mean.heading - robot.heading), 0.0, 1e-6);
  }
}

// On a grid, pairs of landmarks at any distance are many: 1600 of them about 60,000 for one pair of
// places.
TEST(GlobalSearch, WhatThereIsNoTimeForComesAtTheNextScan) {
  std::vector<LandmarkEstimate> grid;
  for (int i = 0; i < 1600; ++i) grid.push_back(landmark(i, i % 40, i / 40));
  const auto places = seen_from({1.0, 2.0, 0.5}, {grid[0], grid[23], grid[700], grid[930]});
  std::size_t next_pair = 0;
  for (int scan = 0; scan < 3; ++scan) {
    const std::size_t before = next_pair;
    EXPECT_TRUE(match_places(places, grid, &next_pair).landmarks.empty());
    EXPECT_GT(next_pair, before);
    EXPECT_LT(next_pair, before + 6) << "all six pairs take too long";
  }
}

// Where distances differ, a large map takes no longer than that allows.
TEST(GlobalSearch, FindsTheRobotAmongAThousandLandmarks) {
  std::vector<LandmarkEstimate> map;
  const RandomStream places(3, RandomPurpose::motion, 0);
  for (std::uint64_t i = 0; i < 1000; ++i) {
    map.push_back(landmark(static_cast<std::int64_t>(i), 200.0 * places.uniform(2 * i),
                           200.0 * places.uniform(2 * i + 1)));
  }
  const std::vector<int> seen = {4, 100, 230, 500, 777, 901};
  std::vector<LandmarkEstimate> some;
  for (const int i : seen) some.push_back(map[static_cast<std::size_t>(i)]);
  std::size_t next_pair = 0;
  const auto matched = match_places(seen_from({50.0, 60.0, -1.0}, some), map, &next_pair);
  EXPECT_EQ(matched.landmarks, seen);
  EXPECT_EQ(next_pair, 0u);
}

}  // namespace
}  // namespace pf_resampling
