#include "pf_resampling_core/fastslam/saved_map.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <set>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

constexpr double kRangeSigma = 0.1;
constexpr double kBearingSigma = 0.02;
constexpr double kReach = 6.0;
const OdometryNoise kOdometry{0.02, 0.02, 0.01, 0.05, 0.003, 0.0, 0.005};

// Landmarks inside and outside of the circle that the robot drives.
std::vector<Eigen::Vector2d> landmarks() {
  std::vector<Eigen::Vector2d> places;
  for (int k = 0; k < 12; ++k) {
    const double angle = 2.0 * kPi * k / 12.0;
    const double radius = k % 2 == 0 ? 7.5 : 2.5;
    places.emplace_back(radius * std::sin(angle), 5.0 - radius * std::cos(angle));
  }
  return places;
}

struct Step {
  Pose2 truth;
  OdometryIncrement odometry;
  std::vector<RangeBearingObservation> observations;
};

// Rounds on a circle of 5 m radius from the origin, 40 steps each, with noise in all that is
// measured. Without ids there is an observation of nothing in every fifth scan.
std::vector<Step> drive(int steps, bool with_ids, std::uint64_t seed) {
  std::vector<Step> all;
  Step step;
  const double turn = 2.0 * kPi / 40.0;
  const Pose2 motion{5.0 * std::sin(turn), 5.0 * (1.0 - std::cos(turn)), turn};
  const std::vector<Eigen::Vector2d> places = landmarks();
  for (int t = 0; t < steps; ++t) {
    const RandomStream noise(seed, RandomPurpose::test, static_cast<std::uint32_t>(t));
    step.odometry = {};
    if (t > 0) {
      step.truth = compose(step.truth, motion);
      const double sigma = 0.02 * std::sqrt(std::hypot(motion.x, motion.y));
      const Pose2 measured{motion.x + sigma * noise.normal(0), motion.y + sigma * noise.normal(1),
                           motion.heading + 0.02 * noise.normal(2)};
      append(kOdometry, measured, 0.5, &step.odometry);
    }
    step.observations.clear();
    for (std::size_t k = 0; k < places.size(); ++k) {
      const Eigen::Vector2d offset = places[k] - Eigen::Vector2d(step.truth.x, step.truth.y);
      const double bearing = wrap_angle(std::atan2(offset.y(), offset.x()) - step.truth.heading);
      if (offset.norm() > kReach || std::abs(bearing) > 2.0) continue;
      RangeBearingObservation z;
      z.id = with_ids ? static_cast<int>(k) : -1;
      z.range = offset.norm() + kRangeSigma * noise.normal(10 + 2 * k);
      z.bearing = wrap_angle(bearing + kBearingSigma * noise.normal(11 + 2 * k));
      step.observations.push_back(z);
    }
    if (!with_ids && t % 5 == 2) {
      RangeBearingObservation clutter;
      clutter.range = 1.0 + 4.0 * noise.uniform(100);
      clutter.bearing = 2.0 * noise.uniform(101) - 1.0;
      step.observations.push_back(clutter);
    }
    all.push_back(step);
  }
  return all;
}

FastSlamOptions some_options(DataAssociation method = DataAssociation::automatic) {
  FastSlamOptions options;
  options.particles = 40;
  options.odometry = kOdometry;
  options.sensor.range_sigma = kRangeSigma;
  options.sensor.bearing_sigma = kBearingSigma;
  options.association.method = method;
  return options;
}

void run(FastSlam* filter, const std::vector<Step>& steps, std::size_t begin, std::size_t end) {
  for (std::size_t t = begin; t < end; ++t) {
    filter->update(steps[t].odometry, steps[t].observations);
  }
}

// All numbers that the filter holds.
std::vector<double> numbers_of(FastSlam* filter) {
  std::vector<double> all;
  const FastSlamParticles& particles = filter->particles();
  for (const Eigen::ArrayXd* array :
       {&particles.x, &particles.y, &particles.heading, &particles.log_weight, &particles.weight}) {
    all.insert(all.end(), array->data(), array->data() + array->size());
  }
  std::vector<std::vector<double>> maps;
  for (const int row : filter->rows()) {
    std::vector<double> map = {static_cast<double>(filter->id_of(row))};
    const LandmarkRow landmark = filter->store().row(row);
    bool is_held = false;
    for (Eigen::Index i = 0; i < particles.size(); ++i) {
      map.push_back(landmark.held[i]);
      if (landmark.held[i] == 0) continue;
      is_held = true;
      for (const double* field :
           {landmark.x, landmark.y, landmark.xx, landmark.xy, landmark.yy, landmark.log_odds}) {
        map.push_back(field[i]);
      }
    }
    if (is_held) maps.push_back(map);
  }
  std::sort(maps.begin(), maps.end());
  for (const std::vector<double>& map : maps) all.insert(all.end(), map.begin(), map.end());
  return all;
}

// Through a file, so that all is checked that way.
SavedMap through_a_file(const SavedMap& map) {
  const std::string path = testing::TempDir() + "saved_map_test.map";
  write_map_file(path, map);
  const SavedMap read = read_map_file(path);
  std::remove(path.c_str());
  return read;
}

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

double distance(const Pose2& a, const Pose2& b) {
  return std::hypot(a.x - b.x, a.y - b.y);
}

// Save, kill, load, continue: exactly what the filter would have done that nobody interrupted, for
// every way of association and of renewal. Saving leaves no trace in the filter either.
TEST(SavedMap, ALoadedFilterGoesOnToTheBit) {
  for (const DataAssociation method : all_data_associations()) {
    std::vector<Step> steps = drive(60, method == DataAssociation::known, 5);
    // Seen only once, and farther than all else: how far landmarks are missed depends on it.
    RangeBearingObservation far;
    far.id = method == DataAssociation::known ? 99 : -1;
    far.range = 9.0;
    steps[0].observations.push_back(far);
    for (const Renewal renewal : all_renewals()) {
      for (const Schedule schedule : {Schedule::effective_sample_size, Schedule::every_n}) {
        FastSlamOptions options = some_options(method);
        options.population.renewal = renewal;
        options.population.schedule = schedule;
        options.population.every_n = 4;
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
    options.population.renewal = Renewal::none;
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
    EXPECT_LE(second.status().distinct_ancestors, count);
  }
}

TEST(SavedMap, SavesSomeOfTheParticlesOrNone) {
  const std::vector<Step> steps = drive(30, false, 5);
  FastSlam filter(some_options(), 7);
  run(&filter, steps, 0, steps.size());
  const std::vector<double> before = numbers_of(&filter);
  const SavedMap some = through_a_file(saved_map(&filter, 15));
  ASSERT_EQ(some.particles.size(), 15u);
  for (const SavedParticle& particle : some.particles) {
    EXPECT_NEAR(particle.weight, 1.0 / 15.0, 1e-12);
    const auto& x = filter.particles().x;
    EXPECT_NE(std::find(x.data(), x.data() + x.size(), particle.pose.x), x.data() + x.size());
  }
  const SavedMap none = through_a_file(saved_map(&filter, 0));
  EXPECT_TRUE(none.particles.empty());
  EXPECT_EQ(none.landmarks.size(), some.landmarks.size());
  EXPECT_THROW(saved_map(&filter, -1), Error);
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

// Mean and covariance of the map that all particles get, against the moments of the mixture, here
// from sums in plain order.
TEST(SavedMap, AFrozenMapIsTheMixtureOfTheParticlesMaps) {
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
TEST(SavedMap, LocalizesInAFrozenMapAndLeavesItAsItIs) {
  for (const bool with_ids : {true, false}) {
    const std::vector<Step> steps = drive(240, with_ids, 5);
    FastSlam mapper(some_options(), 7);
    run(&mapper, steps, 0, 160);
    const SavedMap map = through_a_file(saved_map(&mapper, 1000));
    for (const Renewal renewal : all_renewals()) {
      FastSlamOptions options = some_options();
      options.map.frozen = true;
      options.population.renewal = renewal;
      FastSlam filter(options, 9);
      filter.load(map);
      EXPECT_EQ(filter.particles().x[3], map.particles[3].pose.x);
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
TEST(SavedMap, FreezesAndThawsLive) {
  for (const Renewal renewal : all_renewals()) {
    const std::vector<Step> steps = drive(80, true, 5);
    FastSlamOptions options = some_options();
    options.population.renewal = renewal;
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
    if (renewal != Renewal::resampling) {
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
TEST(SavedMap, LocalizesInASurveyedMap) {
  std::vector<SurveyedLandmark> list;
  const std::vector<Eigen::Vector2d> places = landmarks();
  for (std::size_t k = places.size(); k-- > 0;) {
    list.push_back({static_cast<std::int64_t>(k), places[k], Eigen::Matrix2d::Zero()});
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
  list.push_back(list.front());
  EXPECT_THROW(surveyed_map(list, "site"), Error);
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
      [](SavedMap* map) { map->particles[2].weight = std::nan(""); },
      [](SavedMap* map) { map->particles[39].pose.x = HUGE_VAL; },
      [](SavedMap* map) { map->particles[39].landmarks.back().covariance(0, 1) = 5.0; },
      [](SavedMap* map) { map->particles[5].landmarks[1].id = 1000; },
      [](SavedMap* map) { map->landmarks.push_back(map->landmarks.front()); },
      [](SavedMap* map) { map->view_range = -1.0; },
      [](SavedMap* map) { map->next_id = 0; },
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
  poses.covariance(0, 0) = -1.0;
  EXPECT_THROW(filter.set_poses(poses), Error);
  poses.covariance(0, 0) = 1.0;
  poses.mean.heading = std::nan("");
  EXPECT_THROW(filter.set_poses(poses), Error);
  EXPECT_EQ(filter.particles().x.maxCoeff(), 3.0);
}

}  // namespace
}  // namespace pf_resampling
