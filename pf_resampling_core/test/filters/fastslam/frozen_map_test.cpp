#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"
#include "pf_resampling_core/test/filters/fastslam/circle_drive.hpp"

namespace pf_resampling {
namespace {

using namespace circle_drive;

// Mean and covariance of the map that all particles get, against the moments of the mixture, here
// from sums in plain order.
TEST(FrozenMap, AFrozenMapIsTheMixtureOfTheParticlesMaps) {
  const std::vector<Step> steps = drive(50, true, 5);
  FastSlamOptions options = some_options();
  FastSlam first(options, 7);
  run(&first, steps, 0, 47);
  const SavedMap map = saved_map(&first, 1000);
  options.map.frozen = true;
  options.particles = 25;
  FastSlam second(options, 8);
  second.load(map);
  ASSERT_EQ(second.rows().size(), first.rows().size());
  for (const int row : second.rows()) {
    const LandmarkRow shared = second.store().row(row);
    for (const int other : first.rows()) {
      if (first.id_of(other) != second.id_of(row)) continue;
      const LandmarkRow own = first.store().row(other);
      double sums[6] = {};  // x, y, xx, xy, yy as second moments
      for (Eigen::Index i = 0; i < 40; ++i) {
        const double weight = first.particles().weight[i];
        sums[0] += weight * own.x[i];
        sums[1] += weight * own.y[i];
        sums[2] += weight * (own.xx[i] + own.x[i] * own.x[i]);
        sums[3] += weight * (own.xy[i] + own.x[i] * own.y[i]);
        sums[4] += weight * (own.yy[i] + own.y[i] * own.y[i]);
      }
      for (int i = 0; i < 25; ++i) {
        EXPECT_NEAR(shared.x[i], sums[0], 1e-12);
        EXPECT_NEAR(shared.y[i], sums[1], 1e-12);
        EXPECT_NEAR(shared.xx[i], sums[2] - sums[0] * sums[0], 1e-11);
        EXPECT_NEAR(shared.xy[i], sums[3] - sums[0] * sums[1], 1e-11);
        EXPECT_NEAR(shared.yy[i], sums[4] - sums[1] * sums[1], 1e-11);
        EXPECT_EQ(shared.held[i], 1);
      }
    }
  }
}

// Localization for two rounds in a map that is frozen, with ids and without, for every renewal: the
// map is the same afterwards to the bit, and the robot is where it is.
TEST(FrozenMap, LocalizesInAFrozenMapAndLeavesItAsItIs) {
  for (const bool with_ids : {true, false}) {
    const std::vector<Step> steps = drive(240, with_ids, 5);
    FastSlam mapper(some_options(), 7);
    run(&mapper, steps, 0, 160);
    const SavedMap map = through_a_file(saved_map(&mapper, 1000));
    for (const Renewal renewal : all_values<Renewal>()) {
      FastSlamOptions options = some_options();
      options.map.frozen = true;
      options.strategy.renewal = renewal;
      FastSlam filter(options, 9);
      filter.load(map);
      EXPECT_EQ(filter.particles().x[3], map.particles.x[3]);
      const std::vector<LandmarkEstimate> before = filter.map();
      EXPECT_GE(before.size(), landmarks().size());
      double sum = 0.0;
      for (std::size_t t = 160; t < steps.size(); ++t) {
        filter.update(steps[t].odometry, steps[t].observations);
        sum += std::pow(distance(filter.estimate().mean, steps[t].truth), 2);
        for (const ObservationOutcome& outcome : filter.outcomes()) EXPECT_FALSE(outcome.is_new);
      }
      EXPECT_LT(std::sqrt(sum / 80.0), 0.25) << to_string(renewal) << (with_ids ? " ids" : "");
      const std::vector<LandmarkEstimate> after = filter.map();
      ASSERT_EQ(after.size(), before.size());
      for (std::size_t k = 0; k < after.size(); ++k) {
        EXPECT_EQ(after[k].id, before[k].id);
        EXPECT_EQ(after[k].mean, before[k].mean);
        EXPECT_EQ(after[k].covariance, before[k].covariance);
        EXPECT_EQ(after[k].log_odds, before[k].log_odds);
      }
      // Saved and loaded again it is still the same.
      const SavedMap again = through_a_file(saved_map(&filter, 5));
      for (std::size_t k = 0; k < before.size(); ++k) {
        EXPECT_EQ(again.landmarks[k].estimate.mean, before[k].mean);
        EXPECT_EQ(again.landmarks[k].estimate.covariance, before[k].covariance);
      }
    }
  }
}

// Frozen in the middle of mapping: what particles hold differs, and stays; then it goes on.
TEST(FrozenMap, FreezesAndThawsLive) {
  for (const Renewal renewal : all_values<Renewal>()) {
    const std::vector<Step> steps = drive(80, true, 5);
    FastSlamOptions options = some_options();
    options.strategy.renewal = renewal;
    FastSlam filter(options, 7);
    run(&filter, steps, 0, 15);  // a part of the circle
    const std::size_t known = filter.map().size();
    ASSERT_LT(known, landmarks().size());
    const auto values = [&filter] {
      std::set<std::vector<double>> all;
      for (const int row : filter.rows()) {
        const LandmarkRow landmark = filter.store().row(row);
        for (Eigen::Index i = 0; i < filter.particles().size(); ++i) {
          all.insert({static_cast<double>(filter.id_of(row)), landmark.x[i], landmark.y[i],
                      landmark.xx[i], landmark.xy[i], landmark.yy[i], landmark.log_odds[i]});
        }
      }
      return all;
    };
    const std::set<std::vector<double>> before = values();
    options.map.frozen = true;
    filter.set_options(options);
    run(&filter, steps, 15, 40);
    // Selection may have lost some of them; nothing is new.
    const std::set<std::vector<double>> after = values();
    EXPECT_TRUE(std::includes(before.begin(), before.end(), after.begin(), after.end()));
    if (renewal != Renewal::resampling && renewal != Renewal::redraw) {
      EXPECT_EQ(before, after) << to_string(renewal);
    }
    EXPECT_EQ(filter.status().landmarks, static_cast<int>(known));
    options.map.frozen = false;
    filter.set_options(options);
    run(&filter, steps, 40, steps.size());
    EXPECT_EQ(filter.map().size(), landmarks().size());
    EXPECT_NE(values(), before);
  }
}

// A list of landmarks from elsewhere, without any particles: localization in it, from a pose that
// is given, to the accuracy of the sensor; and mapping that starts with it.
TEST(FrozenMap, LocalizesInASurveyedMap) {
  std::vector<SurveyedLandmark> list;
  const std::vector<Eigen::Vector2d> places = landmarks();
  for (std::size_t k = places.size(); k-- > 0;) {
    list.push_back({static_cast<std::int64_t>(k), places[k]});
  }
  const SavedMap map = through_a_file(surveyed_map(list, "site"));
  EXPECT_EQ(map.frame, "site");
  for (const bool with_ids : {true, false}) {
    const std::vector<Step> steps = drive(80, with_ids, 5);
    FastSlamOptions options = some_options();
    options.map.frozen = true;
    FastSlam filter(options, 9);
    filter.load(map);
    EXPECT_EQ(filter.particles().size(), 40);
    PoseEstimate start;
    start.covariance.diagonal() << 0.04, 0.04, 0.01;
    filter.set_poses(start);
    run(&filter, steps, 0, steps.size());
    EXPECT_LT(distance(filter.estimate().mean, steps.back().truth), 0.2);
    EXPECT_EQ(filter.map().size(), places.size());

    options.map.frozen = false;
    FastSlam mapper(options, 9);
    mapper.load(map);
    run(&mapper, steps, 0, steps.size());
    EXPECT_LT(distance(mapper.estimate().mean, steps.back().truth), 0.2);
    if (with_ids) {
      EXPECT_EQ(mapper.map().size(), places.size());
    }
  }
  // Saved before anything was seen, the ids are still what they were.
  FastSlam idle(some_options(), 9);
  idle.load(map);
  const SavedMap again = through_a_file(saved_map(&idle, 1000));
  EXPECT_EQ(again.association, DataAssociation::known);
  EXPECT_EQ(again.landmarks.size(), places.size());
  list.push_back(list.front());
  EXPECT_THROW(surveyed_map(list, "site"), Error);
}

// What less than half of the weight holds is left out of the map that all share.
TEST(FrozenMap, LeavesOutWhatFewBelieve) {
  SavedMap map = surveyed_map({{1, {3.0, 0.0}}, {2, {0.0, 3.0}}, {3, {1.0, 3.0}}}, "map");
  map.landmarks[0].estimate.held = 0.5;
  map.landmarks[2].estimate.held = 0.499;
  FastSlamOptions options = some_options();
  options.map.frozen = true;
  FastSlam filter(options, 9);
  filter.load(map);
  const std::vector<LandmarkEstimate> loaded = filter.map();
  ASSERT_EQ(loaded.size(), 2u);
  EXPECT_EQ(loaded[0].id, 1);
  EXPECT_EQ(loaded[1].id, 2);
  EXPECT_EQ(filter.status().landmarks, 2);
}

}  // namespace
}  // namespace pf_resampling
