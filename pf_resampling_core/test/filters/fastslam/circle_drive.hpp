#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "pf_resampling_core/filters/fastslam/saved_map.hpp"
#include "pf_resampling_core/population/random_stream.hpp"

/// A small simulated drive for the tests of saved maps, and filters to compare.
namespace pf_resampling::circle_drive {

inline constexpr double kRangeSigma = 0.1;
inline constexpr double kBearingSigma = 0.02;
inline constexpr double kReach = 6.0;
inline const OdometryNoise kOdometry{0.02, 0.02, 0.01, 0.05, 0.003, 0.0, 0.005};

// Landmarks inside and outside of the circle that the robot drives.
inline std::vector<Eigen::Vector2d> landmarks() {
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
inline std::vector<Step> drive(int steps, bool with_ids, std::uint64_t seed) {
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
      step.observations.push_back({with_ids ? static_cast<int>(k) : -1,
                                   offset.norm() + kRangeSigma * noise.normal(10 + 2 * k),
                                   wrap_angle(bearing + kBearingSigma * noise.normal(11 + 2 * k))});
    }
    if (!with_ids && t % 5 == 2) {
      step.observations.push_back(
          {-1, 1.0 + 4.0 * noise.uniform(100), 2.0 * noise.uniform(101) - 1.0});
    }
    all.push_back(step);
  }
  return all;
}

inline FastSlamOptions some_options(DataAssociation method = DataAssociation::automatic) {
  FastSlamOptions options;
  options.particles = 40;
  options.odometry = kOdometry;
  options.odometry_errors.delay = 0.01;  // there is none, and the robot sets off at full speed
  options.odometry_errors.drift = 0.001;
  options.sensor.range_sigma = kRangeSigma;
  options.sensor.range_sigma_share = 0.0;
  options.sensor.bearing_sigma = kBearingSigma;
  options.association.method = method;
  return options;
}

inline void run(FastSlam* filter, const std::vector<Step>& steps, std::size_t begin,
                std::size_t end) {
  for (std::size_t t = begin; t < end; ++t) {
    filter->update(steps[t].odometry, steps[t].observations);
  }
}

// All numbers that the filter holds.
inline std::vector<double> numbers_of(FastSlam* filter) {
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
inline SavedMap through_a_file(const SavedMap& map) {
  const std::string path = testing::TempDir() + "saved_map_test.map";
  write_map_file(path, map);
  const SavedMap read = read_map_file(path);
  std::remove(path.c_str());
  return read;
}

inline double distance(const Pose2& a, const Pose2& b) {
  return std::hypot(a.x - b.x, a.y - b.y);
}

}  // namespace pf_resampling::circle_drive
