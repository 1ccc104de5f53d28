#pragma once

#include <cmath>
#include <cstring>
#include <vector>

#include "pf_resampling_core/filters/beacon_mcl/beacon_mcl.hpp"
#include "pf_resampling_core/filters/beacon_mcl/saved_beacon_mcl.hpp"
#include "pf_resampling_core/simulation/simulate.hpp"

namespace pf_resampling {

/// Four beacons about a field of 20 x 20 m, ids 1 to 4, planar.
inline std::vector<Beacon> square_of_beacons() {
  return {{1, {0.0, 0.0, 0.0}, true},
          {2, {20.0, 0.0, 0.0}, true},
          {3, {20.0, 20.0, 0.0}, true},
          {4, {0.0, 20.0, 0.0}, true}};
}

/// Nothing is random but the start, nothing is learnt, nothing is renewed: what is left is the
/// likelihood.
inline BeaconMclOptions plain_options() {
  BeaconMclOptions options;
  options.particles = 500;
  options.strategy.schedule = Schedule::never;
  options.strategy.excitation.method = Excitation::none;
  OdometryNoise& odometry = options.odometry;
  odometry.translation_per_distance = odometry.slip_per_distance = 0.0;
  odometry.heading_per_distance = odometry.heading_per_angle = odometry.heading_per_time = 0.0;
  odometry.translation_per_time = 0.0;
  options.ranges.outlier_share = 0.0;
  options.calibration.estimation = CalibrationEstimation::off;
  options.calibration.scale_walk = options.calibration.bias_walk = 0.0;
  options.noise_estimation.ranges = options.noise_estimation.odometry = false;
  options.yaw_rate_bias.estimate = false;
  options.recovery.enabled = false;
  options.initialization.method = Initialization::gaussian;
  options.initialization.x = 8.0;
  options.initialization.y = 9.0;
  options.initialization.heading = 0.3;
  options.initialization.sigma_position = 1.0;
  options.initialization.sigma_heading = 0.3;
  return options;
}

/// The same with a start that is known exactly: all particles are equal and stay so.
inline BeaconMclOptions known_pose_options() {
  BeaconMclOptions options = plain_options();
  options.initialization.sigma_position = options.initialization.sigma_heading = 0.0;
  options.particles = 20;
  return options;
}

inline RangeObservation range_of(int beacon, double range, double variance = 0.0,
                                 const Eigen::Vector3d& antenna = Eigen::Vector3d::Zero()) {
  return {beacon, range, variance, antenna};
}

/// Dead reckoning of one step.
inline OdometryIncrement step_of(const OdometryNoise& noise, const Pose2& motion, double duration) {
  OdometryIncrement increment;
  append(noise, motion, duration, &increment);
  return increment;
}

/// A filter that has drawn, learnt and renewed for a while, with everything switched on.
inline BeaconMcl lived_in(const BeaconMclOptions& options, int updates = 30,
                          std::uint64_t seed = 5) {
  BeaconMcl filter(options, square_of_beacons(), seed);
  const Pose2 step{0.1, 0.0, 0.02};
  Pose2 truth{8.0, 9.0, 0.3};
  for (int i = 0; i < updates; ++i) {
    truth = compose(truth, step);
    const Beacon beacon = filter.beacons()[static_cast<std::size_t>(i % 4)];
    const double distance =
        std::hypot(beacon.position.x() - truth.x, beacon.position.y() - truth.y);
    filter.update(step_of(options.odometry, step, 0.1),
                  {range_of(beacon.id, 1.05 * distance + 0.1 + 0.3 * std::sin(9.0 * i))});
  }
  return filter;
}

inline BeaconMclOptions default_options_with(int particles) {
  BeaconMclOptions options;
  options.particles = particles;
  return options;
}

/// Every number of the population and of the filter's belief, for comparing bit by bit.
/// Learnt, of the ranges' standard deviation.
inline double range_noise_factor(const BeaconMcl& filter) {
  const BeaconMclProgress progress = filter.saved().progress;
  return std::sqrt(progress.range_squares / progress.range_count);
}

inline std::vector<double> all_numbers(const BeaconMcl& filter) {
  const BeaconMclParticles& p = filter.particles();
  std::vector<double> numbers;
  for (const Eigen::ArrayXd* array :
       {&p.x, &p.y, &p.heading, &p.log_weight, &p.weight, &p.yaw_rate_bias,
        &p.yaw_rate_bias_variance, &p.translation_factor, &p.heading_factor, &p.scale, &p.bias,
        &p.scale_variance, &p.scale_bias_covariance, &p.bias_variance}) {
    numbers.insert(numbers.end(), array->data(), array->data() + array->size());
  }
  for (Eigen::Index i = 0; i < p.ancestor.size(); ++i) numbers.push_back(p.ancestor[i]);
  const BeaconMclStatus& s = filter.status();
  for (const double value :
       {static_cast<double>(s.particles), s.effective_sample_size, s.entropy_sample_size,
        static_cast<double>(s.distinct_ancestors_of_renewal), static_cast<double>(s.updates),
        static_cast<double>(s.renewals), static_cast<double>(s.weight_resets),
        static_cast<double>(s.injected), s.log_likelihood, s.innovation, s.innovation_sigma,
        filter.is_initialized() ? range_noise_factor(filter) : 1.0}) {
    numbers.push_back(value);
  }
  return numbers;
}

inline bool same_bytes(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0);
}

inline bool all_finite(const BeaconMcl& filter) {
  for (const double number : all_numbers(filter)) {
    if (!std::isfinite(number)) return false;
  }
  if (!filter.is_initialized()) return true;
  const PoseEstimate estimate = filter.estimate();
  return std::isfinite(estimate.mean.x) && std::isfinite(estimate.mean.y) &&
         std::isfinite(estimate.mean.heading) && estimate.covariance.allFinite();
}

/// Six beacons over 30 x 30 m, a robot on a circle of 10 m radius at 1 m/s with the noise of good
/// odometry and ranges at 10 Hz that err by `scale` and `bias` and sigma 0.4 m.
inline World circle_among_six_beacons(double scale, double bias, double duration) {
  World world;
  world.start = {25.0, 15.0, M_PI / 2};
  for (int i = 1; i <= 24; ++i) {
    const double angle = 2.0 * M_PI * i / 24.0;
    world.waypoints.emplace_back(15.0 + 10.0 * std::cos(angle), 15.0 + 10.0 * std::sin(angle));
  }
  world.repeat = true;
  world.duration = duration;
  const double places[6][2] = {{2, 3}, {27.5, 1.5}, {29, 16}, {26, 28.5}, {4.5, 28}, {0.5, 14}};
  for (int i = 0; i < 6; ++i) {
    SimulatedBeacon beacon;
    beacon.beacon = {i + 1, {places[i][0], places[i][1], 0.0}, true};
    beacon.errors = {scale, bias, 0.4};
    world.beacons.push_back(beacon);
  }
  world.drive.yaw_rate_limit = 1.0;
  world.odometry.speed_sigma = 0.05;
  world.odometry.lateral_sigma = 0.03;
  world.odometry.yaw_rate_sigma = 0.006;
  world.ranges.rate = 10.0;
  return world;
}

inline std::vector<Beacon> beacons_of(const World& world) {
  std::vector<Beacon> beacons;
  for (const SimulatedBeacon& beacon : world.beacons) beacons.push_back(beacon.beacon);
  return beacons;
}

/// Feeds a simulated drive, odometry and ranges at 10 Hz, to the filter; after each update calls
/// look(time, truth).
template <typename Look>
void run_drive(const SimulatedDrive& drive, BeaconMcl* filter, const Look& look) {
  std::size_t next_range = 0;
  for (std::size_t i = 1; i < drive.odometry.size(); ++i) {
    const SimulatedDrive::Odometry& before = drive.odometry[i - 1];
    const SimulatedDrive::Odometry& now = drive.odometry[i];
    std::vector<RangeObservation> ranges;
    while (next_range < drive.ranges.size() && drive.ranges[next_range].time <= now.time + 1e-6) {
      const SimulatedDrive::Range& range = drive.ranges[next_range++];
      if (range.range > 0.0) ranges.push_back(range_of(range.beacon, range.range));
    }
    filter->update(step_of(filter->options().odometry, relative(before.pose, now.pose),
                           now.time - before.time),
                   ranges);
    look(now.time, now.truth);
  }
}

inline double position_error(const BeaconMcl& filter, const Pose2& truth) {
  const Pose2 mean = filter.estimate().mean;
  return std::hypot(mean.x - truth.x, mean.y - truth.y);
}

}  // namespace pf_resampling
