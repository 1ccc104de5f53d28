#include "pf_resampling_core/filters/fastslam/landmark_changes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

constexpr double kSigma = 0.05;  // m, of what is seen

// A corridor with a landmark every two metres, on the left and on the right, that the robot drives
// along at 1 m/s, seeing 6 m ahead; the map is right but for what a test changes.
class Corridor {
 public:
  explicit Corridor(bool map_is_given = true) {
    for (int k = 0; k < 40; ++k) map_[k] = {2.0 * k, k % 2 == 0 ? 2.0 : -2.0};
    for (const auto& [id, place] : map_) tags_.emplace(id, place);
    if (map_is_given) changes_.start(map());
  }

  void drive(double error = 0.0, bool is_back = false) {
    int looks = 0;
    for (double driven = 0.0; driven < 85.0; driven += 0.2, time_ += 0.2) {
      const double x = is_back ? 80.0 - driven : driven - 5.0;
      const double heading = is_back ? kPi : 0.0;
      const RandomStream noise(1, RandomPurpose::simulation_observation, step_++);
      std::vector<MapSighting> sightings;
      std::uint64_t draw = 0;
      const auto is_shown = [&](std::int64_t id) {
        return (id != rare_ || ++looks % 7 == 0) && (!blink_ || (step_ + id) % 2 == 0);
      };
      for (const auto& [id, place] : tags_) {
        const Eigen::Vector2d there = (is_back ? -1.0 : 1.0) * (place - Eigen::Vector2d(x, 0.0));
        if (is_back && have_backs_) continue;
        if (there.norm() > 6.0 || std::abs(std::atan2(there.y(), there.x())) > 0.6) continue;
        if (!is_shown(id)) continue;
        MapSighting sighting;
        sighting.id = id;
        sighting.sigma = kSigma;
        sighting.mapped = map_.at(id);
        sighting.seen = place + Eigen::Vector2d(error, 0.0) +
                        kSigma * Eigen::Vector2d(noise.normal(draw), noise.normal(draw + 1));
        sighting.is_believed = (sighting.seen - map_.at(id)).norm() < believed_;
        if (starts_anew_) {
          sighting.mapped = sighting.seen;
          sighting.is_believed = sighting.is_started = true;
        }
        draw += 2;
        sightings.push_back(sighting);
      }
      path_.push_back({x, 0.0, heading});
      const Pose2 believed = {x + error, 0.0, heading};
      const MapScan scan = {time_, path_.size() - 1, believed, believed, sigma_, sightings};
      changes_.remember(scan);
      changes_.add(scan);
    }
    time_ += 60.0;
  }

  std::vector<LandmarkEstimate> map() const {
    std::vector<LandmarkEstimate> map(map_.size());
    for (const auto& [id, place] : map_) {
      map[static_cast<std::size_t>(id)].id = id;
      map[static_cast<std::size_t>(id)].mean = place;
    }
    return map;
  }

  // What is found: that landmark 20 was moved.
  Finding moved() const {
    const std::vector<Finding> found = changes_.findings();
    EXPECT_EQ(found.size(), 1u);
    EXPECT_EQ(found.at(0).kind, FindingKind::landmark_moved);
    EXPECT_EQ(found.at(0).id, 20);
    return found[0];
  }

  LandmarkChanges changes_;
  std::map<std::int64_t, Eigen::Vector2d> map_;
  std::multimap<std::int64_t, Eigen::Vector2d> tags_;  // as they are
  double believed_ = 0.2;                              // m from where the map has it
  bool starts_anew_ = false;                           // what is seen is taken for new
  std::int64_t rare_ = -1;                             // one in seven scans shows it
  bool have_backs_ = false;                            // tags
  bool blink_ = false;                                 // every other scan shows them
  double sigma_ = 0.1;                                 // m, of the robot in the map
  std::vector<Pose2> path_;                            // as it is
  double time_ = 0.0;
  std::uint32_t step_ = 0;
};

TEST(LandmarkChanges, NothingIsFoundWhereNothingHasChanged) {
  Corridor corridor;
  for (int k = 0; k < 3; ++k) corridor.drive();
  EXPECT_TRUE(corridor.changes_.findings().empty());
}

TEST(LandmarkChanges, ALandmarkIsWhereItWasMovedTo) {
  Corridor corridor;
  corridor.tags_.find(20)->second += Eigen::Vector2d(0.6, 0.8);
  corridor.drive();
  const Finding found = corridor.moved();
  EXPECT_NEAR(found.size, 1.0, 0.05);
  EXPECT_NEAR(found.place.x(), 40.6, 0.05);
  EXPECT_GT(found.probability, 0.9);
  EXPECT_FALSE(found.is_open);  // it is long out of view
  EXPECT_EQ(sentence_of(found, 0.0), "landmark 20 is 1.0 m from the map");
}

// Only one beside it shows how sure the robot is of its place, but it is not where it was.
TEST(LandmarkChanges, ALandmarkThatIsNotWhereItWasIsWhereItIsSeen) {
  Corridor corridor;
  for (const int id : {15, 16, 17, 18, 21, 22, 23, 24, 25}) corridor.tags_.erase(id);
  corridor.tags_.find(20)->second += Eigen::Vector2d(0.6, 0.8);
  corridor.sigma_ = 0.5;
  for (int k = 0; k < 3; ++k) corridor.drive();
  const std::vector<Finding> found = corridor.changes_.findings();
  const auto moved = std::find_if(found.begin(), found.end(),
                                  [](const Finding& finding) { return finding.id == 20; });
  ASSERT_NE(moved, found.end());
  EXPECT_EQ(moved->kind, FindingKind::landmark_moved);
  EXPECT_NEAR(moved->size, 1.0, 0.05);
  EXPECT_GT(moved->probability, 0.9);
}

// Each time that it passes the robot sees it twice: too few to say where it is, but it comes again.
TEST(LandmarkChanges, ALandmarkThatIsHardlySeenIsWhereItWasMovedTo) {
  Corridor corridor;
  corridor.tags_.find(20)->second += Eigen::Vector2d(4.0, 0.0);
  corridor.rare_ = 20;
  corridor.drive();
  ASSERT_EQ(corridor.changes_.findings().size(), 1u);
  EXPECT_EQ(corridor.changes_.findings()[0].kind, FindingKind::landmark_gone);
  for (int k = 0; k < 2; ++k) corridor.drive();
  corridor.moved();
}

// The same where nothing looks at the place that it had.
TEST(LandmarkChanges, ALandmarkThatIsHardlySeenIsFoundInLapsOfMinutes) {
  Corridor corridor(false);
  corridor.map_[20] = {40.0, 4.0};
  corridor.changes_.start(corridor.map());
  corridor.rare_ = 20;
  corridor.drive();
  EXPECT_TRUE(corridor.changes_.findings().empty());
  for (int k = 0; k < 2; ++k) corridor.drive();
  corridor.moved();
}

// It is within what the filter believes, but always on the same side. Where all are, it is the
// sensor.
// Beside others that are where they were, an error that all share counts no more.
TEST(LandmarkChanges, ALandmarkThatWasMovedByLittleIsFound) {
  for (const double sigma : {0.1, 0.3}) {
    Corridor corridor;
    corridor.believed_ = 1.0;
    corridor.sigma_ = sigma;
    corridor.tags_.find(20)->second.y() += 0.6;
    corridor.drive();
    const Finding found = corridor.moved();
    EXPECT_NEAR(found.size, 0.6, 0.05);
    Corridor shifted;
    shifted.believed_ = 1.0;
    shifted.sigma_ = sigma;
    shifted.drive(0.6);
    EXPECT_TRUE(shifted.changes_.findings().empty()) << sigma;
  }
}

TEST(LandmarkChanges, AnIdIsAtTwoPlaces) {
  Corridor corridor;
  corridor.tags_.erase(30);
  corridor.tags_.emplace(10, corridor.map_.at(30));
  corridor.drive();
  const std::vector<Finding> found = corridor.changes_.findings();
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].kind, FindingKind::landmark_twice);
  EXPECT_EQ(found[0].id, 10);
  EXPECT_NEAR(found[0].size, 40.0, 0.1);
  EXPECT_EQ(found[1].kind, FindingKind::landmark_gone);
  EXPECT_EQ(found[1].id, 30);
}

// Where any scan may overlook a landmark, one visit in which it was hidden may be chance, though of
// forty others none was.
TEST(LandmarkChanges, ALandmarkIsGoneUntilItIsSeenAgain) {
  for (const bool blink : {false, true}) {
    Corridor corridor;
    corridor.blink_ = blink;
    corridor.tags_.erase(20);
    corridor.drive();
    EXPECT_EQ(corridor.changes_.findings().empty(), blink);
    corridor.drive();
    const std::vector<Finding> found = corridor.changes_.findings();
    ASSERT_EQ(found.size(), 1u) << blink;
    EXPECT_EQ(found[0].kind, FindingKind::landmark_gone);
    EXPECT_EQ(found[0].id, 20);
    EXPECT_EQ(found[0].place, corridor.map_.at(20));
    corridor.tags_.emplace(20, corridor.map_.at(20));
    corridor.drive();
    EXPECT_TRUE(corridor.changes_.findings().empty()) << blink;
  }
}

TEST(LandmarkChanges, AnIdThatWasMisreadOnceIsNotGone) {
  Corridor corridor;
  MapSighting misread;
  misread.id = 99;
  misread.seen = {30.0, 1.0};
  misread.is_started = true;
  corridor.changes_.add({0.0, 0, {26.0, 0.0, 0.0}, {26.0, 0.0, 0.0}, 0.1, {misread}});
  for (int k = 0; k < 3; ++k) corridor.drive();
  EXPECT_TRUE(corridor.changes_.findings().empty());
}

TEST(LandmarkChanges, ABeliefThatIsWrongSaysNothingOfLandmarks) {
  Corridor corridor;
  corridor.drive();
  corridor.drive(1.5);
  EXPECT_TRUE(corridor.changes_.findings().empty());
  corridor.changes_.forget_latest();
  corridor.drive();
  EXPECT_TRUE(corridor.changes_.findings().empty());
}

// Tags that are numbered from 1 in a list that begins at 0: near one the robot may be where it
// believes, but the next does not fit.
TEST(LandmarkChanges, AListThatIsOffByOneMisfits) {
  Corridor corridor;
  corridor.drive();
  EXPECT_FALSE(corridor.changes_.map_misfits());
  corridor.tags_.clear();
  for (int k = 0; k < 39; ++k) corridor.tags_.emplace(k + 1, corridor.map_.at(k));
  corridor.drive();
  EXPECT_TRUE(corridor.changes_.map_misfits());
}

// The filter has started all of them anew where a belief that is metres off has put them.
TEST(LandmarkChanges, LandmarksThatAreAllBelievedElsewhereConfirmNoneOfThem) {
  Corridor corridor;
  corridor.drive();
  corridor.starts_anew_ = true;
  corridor.drive(6.0);
  EXPECT_TRUE(corridor.changes_.findings().empty());
}

// After a redraw that turned the map, what was found goes along.
TEST(LandmarkChanges, FindingsFollowTheMap) {
  Corridor corridor;
  corridor.tags_.find(20)->second.y() -= 1.0;
  corridor.drive();
  std::vector<LandmarkEstimate> shifted = corridor.map();
  for (LandmarkEstimate& landmark : shifted) landmark.mean.y() += 5.0;
  corridor.changes_.follow(shifted);
  const std::vector<Finding> found = corridor.changes_.findings();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].place.y(), corridor.map_.at(20).y() + 4.0, 0.05);
  EXPECT_NEAR(found[0].size, 1.0, 0.05);
}

// Where the belief was wrong, what was seen of a landmark from there goes along with its
// neighbours.
TEST(LandmarkChanges, TwoPlacesThatTurnOutToBeOneAreOne) {
  Corridor corridor;
  corridor.drive();
  corridor.tags_.find(20)->second += Eigen::Vector2d(0.6, 0.8);
  corridor.drive();
  ASSERT_EQ(corridor.changes_.findings().size(), 1u);
  std::vector<LandmarkEstimate> map = corridor.map();
  map[22].mean -= Eigen::Vector2d(0.6, 0.8);
  corridor.changes_.follow(map);
  EXPECT_TRUE(corridor.changes_.findings().empty());
}

// The belief is metres off while the robot passes: what it saw then says nothing of landmarks until
// the whole drive, solved for anew, shows where it was.
TEST(LandmarkChanges, WhatWasSeenUnderAWrongBeliefIsWhereThePathHasIt) {
  for (const double error : {0.0, 2.5}) {
    Corridor corridor(false);
    corridor.drive();
    corridor.tags_.find(20)->second += Eigen::Vector2d(0.6, 0.8);
    corridor.drive(error);
    corridor.changes_.forget_latest();
    if (error > 0.0) {
      EXPECT_TRUE(corridor.changes_.findings().empty());
    }
    corridor.changes_.retrace(corridor.path_, corridor.map());
    const Finding found = corridor.moved();
    EXPECT_NEAR(found.size, 1.0, 0.05);
  }
}

// A robot that does not know where in the map it is knows where landmarks are beside each other.
TEST(LandmarkChanges, ALandmarkOfAMapInTheMakingIsNotWhereItWasBesideOthers) {
  Corridor corridor(false);
  corridor.sigma_ = 0.7;
  corridor.drive();
  corridor.tags_.find(20)->second += Eigen::Vector2d(0.3, 0.4);
  corridor.drive();
  corridor.drive();
  const std::vector<Finding> found = corridor.changes_.findings();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].id, 20);
  EXPECT_NEAR(found[0].size, 0.5, 0.05);
}

// It is in view from behind, and is not seen: if others are, it is gone; if none is, they have
// backs.
TEST(LandmarkChanges, ALandmarkThatIsNotSeenFromBehindIsGoneIfOthersAreSeen) {
  for (const bool have_backs : {false, true}) {
    Corridor corridor(false);
    corridor.have_backs_ = have_backs;
    corridor.drive();
    corridor.tags_.erase(20);
    for (int k = 0; k < 2; ++k) corridor.drive(0.0, true);
    EXPECT_EQ(corridor.changes_.findings().size(), have_backs ? 0u : 1u);
  }
}

}  // namespace
}  // namespace pf_resampling
