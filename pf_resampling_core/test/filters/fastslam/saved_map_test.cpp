#include "pf_resampling_core/filters/fastslam/saved_map.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/filters/fastslam/circle_drive.hpp"

namespace pf_resampling {
namespace {

using namespace circle_drive;

double map_rms(FastSlam* filter) {
  const std::vector<Eigen::Vector2d> places = landmarks();
  double sum = 0.0;
  const std::vector<LandmarkEstimate> map = filter->map();
  for (const LandmarkEstimate& landmark : map) {
    double nearest = 1e9;
    for (const Eigen::Vector2d& place : places) {
      nearest = std::min(nearest, (landmark.mean - place).squaredNorm());
    }
    sum += nearest;
  }
  return std::sqrt(sum / static_cast<double>(map.size()));
}

// Save, kill, load, continue: exactly what the filter would have done that nobody interrupted, for
// every way of association and of renewal. Saving leaves no trace in the filter either.
TEST(SavedMap, ALoadedFilterGoesOnToTheBit) {
  for (const DataAssociation method : all_values<DataAssociation>()) {
    std::vector<Step> steps = drive(60, method == DataAssociation::known, 5);
    // Seen only once, and farther than all else: how far landmarks are missed depends on it.
    steps[0].observations.push_back({method == DataAssociation::known ? 99 : -1, 9.0});
    for (const Renewal renewal : all_values<Renewal>()) {
      for (const Schedule schedule : {Schedule::effective_sample_size, Schedule::every_n}) {
        FastSlamOptions options = some_options(method);
        options.strategy.renewal = renewal;
        options.strategy.schedule = schedule;
        options.strategy.every_n = 4;
        FastSlam uninterrupted(options, 7);
        run(&uninterrupted, steps, 0, steps.size());
        FastSlam first(options, 7);
        run(&first, steps, 0, 34);
        const SavedMap map = through_a_file(saved_map(&first, 1000));
        FastSlam second(options, 7);
        run(&second, steps, 0, 3);  // whatever it did before
        second.load(map);
        EXPECT_EQ(numbers_of(&second), numbers_of(&first));
        run(&first, steps, 34, steps.size());
        run(&second, steps, 34, steps.size());
        const std::string name = to_string(method) + ", " + to_string(renewal);
        EXPECT_EQ(numbers_of(&first), numbers_of(&uninterrupted)) << name;
        EXPECT_EQ(numbers_of(&second), numbers_of(&uninterrupted)) << name;
        EXPECT_EQ(second.association(), uninterrupted.association());
      }
    }
  }
}

// With other random numbers from the middle on: the map's error is that of uninterrupted runs. Two
// samples of 12 runs; |t| of Welch's test above 7 by chance has a probability below 1e-6.
TEST(SavedMap, ErrorsAfterLoadingAreThoseOfUninterruptedRuns) {
  const int runs = 12;
  std::vector<double> errors[2];
  for (int i = 0; i < runs; ++i) {
    const std::vector<Step> steps = drive(120, true, 100 + static_cast<std::uint64_t>(i));
    FastSlam uninterrupted(some_options(), 1 + static_cast<std::uint64_t>(i));
    run(&uninterrupted, steps, 0, steps.size());
    errors[0].push_back(map_rms(&uninterrupted));
    const std::vector<Step> others = drive(120, true, 200 + static_cast<std::uint64_t>(i));
    FastSlam first(some_options(), 1001 + static_cast<std::uint64_t>(i));
    run(&first, others, 0, 60);
    FastSlam second(some_options(), 2001 + static_cast<std::uint64_t>(i));
    second.load(through_a_file(saved_map(&first, 1000)));
    run(&second, others, 60, others.size());
    errors[1].push_back(map_rms(&second));
  }
  double means[2], variances[2];
  for (int k = 0; k < 2; ++k) {
    means[k] = variances[k] = 0.0;
    for (const double error : errors[k]) means[k] += error / runs;
    for (const double error : errors[k]) variances[k] += std::pow(error - means[k], 2) / (runs - 1);
  }
  EXPECT_LT(means[1], 0.3);
  EXPECT_LT(std::abs(means[1] - means[0]), 7.0 * std::sqrt((variances[0] + variances[1]) / runs))
      << means[0] << " m and " << means[1] << " m";
}

// Another number of particles than was saved, both ways: the belief stays, and the filter goes on.
TEST(SavedMap, LoadsAnotherNumberOfParticles) {
  const std::vector<Step> steps = drive(80, true, 5);
  FastSlam first(some_options(), 7);
  run(&first, steps, 0, 60);
  const SavedMap map = saved_map(&first, 1000);
  for (const int count : {10, 40, 300}) {
    FastSlamOptions options = some_options();
    options.particles = count;
    options.strategy.renewal = Renewal::none;
    FastSlam second(options, 8);
    second.load(map);
    EXPECT_EQ(second.particles().size(), count);
    EXPECT_EQ(second.store().particles(), count);
    EXPECT_EQ(second.status().particles, count);
    EXPECT_EQ(second.status().landmarks, 12);
    EXPECT_NEAR(second.particles().weight.sum(), 1.0, 1e-9);
    const PoseEstimate before = first.estimate();
    EXPECT_LT(distance(second.estimate().mean, before.mean), 0.1);
    run(&second, steps, 60, 80);
    EXPECT_LT(distance(second.estimate().mean, steps.back().truth), 0.5);
    EXPECT_LE(second.status().distinct_ancestors_since_start, count);
  }
}

TEST(SavedMap, SavesSomeOfTheParticlesOrNone) {
  const std::vector<Step> steps = drive(30, false, 5);
  FastSlam filter(some_options(), 7);
  run(&filter, steps, 0, steps.size());
  const std::vector<double> before = numbers_of(&filter);
  const SavedMap some = through_a_file(saved_map(&filter, 15));
  ASSERT_EQ(some.particles.size(), 15);
  for (Eigen::Index i = 0; i < 15; ++i) {
    EXPECT_NEAR(some.particles.weight[i], 1.0 / 15.0, 1e-12);
    const auto& x = filter.particles().x;
    EXPECT_NE(std::find(x.data(), x.data() + x.size(), some.particles.x[i]), x.data() + x.size());
  }
  const SavedMap none = through_a_file(saved_map(&filter, 0));
  EXPECT_EQ(none.particles.size(), 0);
  EXPECT_EQ(none.landmarks.size(), some.landmarks.size());
  EXPECT_EQ(numbers_of(&filter), before);

  // The map that is saved is the map that is shown.
  const std::vector<LandmarkEstimate> map = filter.map();
  std::size_t shown = 0;
  for (const SavedLandmark& landmark : none.landmarks) {
    if (!(landmark.estimate.held > 0.0)) continue;
    ASSERT_LT(shown, map.size());
    EXPECT_EQ(landmark.estimate.id, map[shown].id);
    EXPECT_EQ(landmark.estimate.mean, map[shown].mean);
    EXPECT_EQ(landmark.estimate.covariance, map[shown].covariance);
    EXPECT_EQ(landmark.estimate.log_odds, map[shown].log_odds);
    ++shown;
  }
  EXPECT_EQ(shown, map.size());
}

// A landmark found after loading gets an id of its own.
TEST(SavedMap, NewLandmarksGetNewIds) {
  const std::vector<Step> steps = drive(60, false, 5);
  FastSlam first(some_options(), 7);
  run(&first, steps, 0, 10);
  SavedMap map = saved_map(&first, 1000);
  const std::int64_t last = map.landmarks.back().estimate.id;
  ASSERT_GT(map.next_id, last);
  map.next_id = last + 100;  // those in between were removed
  FastSlam second(some_options(), 8);
  second.load(map);
  run(&second, steps, 10, steps.size());
  std::set<std::int64_t> ids;
  for (const LandmarkEstimate& landmark : second.map()) {
    EXPECT_TRUE(ids.insert(landmark.id).second);
    EXPECT_TRUE(landmark.id <= last || landmark.id >= last + 100) << landmark.id;
  }
  EXPECT_GT(*ids.rbegin(), last);
}

TEST(SavedMap, ARefusedMapChangesNothing) {
  const std::vector<Step> steps = drive(40, false, 5);
  FastSlam filter(some_options(), 7);
  run(&filter, steps, 0, 20);
  const SavedMap good = saved_map(&filter, 1000);
  run(&filter, steps, 20, 30);
  const std::vector<double> before = numbers_of(&filter);
  const std::vector<std::function<void(SavedMap*)>> faults = {
      [](SavedMap* map) { map->particle_maps[5][1].id = 1000; },
      [](SavedMap* map) { map->landmarks.push_back(map->landmarks.front()); },
      [](SavedMap* map) { map->view_range = -1.0; },
  };
  for (std::size_t i = 0; i < faults.size(); ++i) {
    SavedMap bad = good;
    faults[i](&bad);
    EXPECT_THROW(filter.load(bad), Error) << "fault " << i;
    EXPECT_EQ(numbers_of(&filter), before) << "fault " << i;
  }
  // Numbers in order of discovery are no ids of observations.
  FastSlam by_id(some_options(DataAssociation::known), 7);
  EXPECT_THROW(by_id.load(good), Error);
  FastSlam untouched(some_options(), 7);
  run(&untouched, steps, 0, steps.size());
  run(&filter, steps, 30, steps.size());
  EXPECT_EQ(numbers_of(&filter), numbers_of(&untouched));
}

// Means within 6 standard errors and variances within 6 of theirs: false alarm below 1e-6.
TEST(SavedMap, SetPosesDrawsFromTheGaussianAndKeepsTheMaps) {
  FastSlamOptions options = some_options();
  options.particles = 20000;
  FastSlam filter(options, 7);
  const std::vector<Step> steps = drive(3, true, 5);
  run(&filter, steps, 0, 3);
  const std::vector<LandmarkEstimate> map = filter.map();
  const int row = filter.rows()[0];
  const double x_of_one = filter.store().row(row).x[17];
  PoseEstimate poses;
  poses.mean = {3.0, -2.0, kPi - 0.01 + 2.0 * kPi};
  poses.covariance << 0.25, 0.1, 0.02, 0.1, 0.16, -0.01, 0.02, -0.01, 0.04;
  filter.set_poses(poses);
  const PoseEstimate drawn = filter.estimate();
  const double n = options.particles;
  EXPECT_NEAR(drawn.mean.x, 3.0, 6.0 * std::sqrt(0.25 / n));
  EXPECT_NEAR(drawn.mean.y, -2.0, 6.0 * std::sqrt(0.16 / n));
  EXPECT_NEAR(wrap_angle(drawn.mean.heading - kPi + 0.01), 0.0, 6.0 * std::sqrt(0.04 / n));
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const double c = poses.covariance(i, j);
      const double sigma = std::sqrt((c * c + poses.covariance(i, i) * poses.covariance(j, j)) / n);
      EXPECT_NEAR(drawn.covariance(i, j), c, 6.0 * sigma);
    }
  }
  EXPECT_LE(filter.particles().heading.abs().maxCoeff(), kPi);
  EXPECT_EQ(filter.particles().weight.minCoeff(), filter.particles().weight.maxCoeff());
  EXPECT_EQ(filter.store().row(row).x[17], x_of_one);
  EXPECT_EQ(filter.map().size(), map.size());
  // Again, it is another draw; a covariance of zero is the pose itself.
  const double first = filter.particles().x[0];
  filter.set_poses(poses);
  EXPECT_NE(filter.particles().x[0], first);
  poses.covariance.setZero();
  filter.set_poses(poses);
  EXPECT_EQ(filter.particles().x.minCoeff(), 3.0);
  EXPECT_EQ(filter.particles().x.maxCoeff(), 3.0);
  // What was computed is symmetric but for rounding; what differs by more is a mistake.
  poses.covariance = Eigen::Vector3d(0.25, 0.16, 0.04).asDiagonal();
  poses.covariance(0, 1) = 1e-12;
  filter.set_poses(poses);
  poses.covariance(0, 1) = 1e-3;
  EXPECT_THROW(filter.set_poses(poses), Error);
  poses.covariance.setZero();
  filter.set_poses(poses);
  poses.covariance(0, 0) = -1.0;
  EXPECT_THROW(filter.set_poses(poses), Error);
  poses.covariance(0, 0) = 1.0;
  poses.mean.heading = std::nan("");
  EXPECT_THROW(filter.set_poses(poses), Error);
  EXPECT_EQ(filter.particles().x.maxCoeff(), 3.0);
}

}  // namespace
}  // namespace pf_resampling
