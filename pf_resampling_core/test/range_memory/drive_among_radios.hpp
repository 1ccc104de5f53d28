#pragma once

#include <Eigen/Core>
#include <cmath>
#include <random>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/models/beacon_range.hpp"
#include "pf_resampling_core/models/odometry_motion.hpp"
#include "pf_resampling_core/range_memory/range_memory.hpp"

namespace pf_resampling {

inline const RadioKnowledge& radio_of(const std::vector<RadioKnowledge>& radios, int id) {
  for (const RadioKnowledge& radio : radios) {
    if (radio.id == id) return radio;
  }
  throw Error("no such radio");
}

/// A robot that drives loops of 14 by 8 m among four radios, 20 by 14 m apart.
struct DriveAmongRadios {
  std::vector<Beacon> beacons;  ///< where they are
  double sigma = 0.1;           ///< m
  double scale = 1.01;
  double bias = 0.1;  ///< m
  double distance_scale = 1.0;
  double turn_scale = 1.0;
  double yaw_rate_bias = 1e-3;                        ///< rad/s
  Eigen::Vector3d antenna = Eigen::Vector3d::Zero();  ///< m
  double reflected = 0.03;       ///< share of ranges, 1.5 m too long on average
  double wild = 0.0;             ///< share of ranges, anything up to 40 m
  double straight = 0.0;         ///< m, before the first turn
  int radio_that_repeats = -1;   ///< its ranges are those of the first, ...
  bool repeats_exactly = false;  ///< ... error and all
  double biased = 0.0;           ///< m, of the last radio

  double first_range = 0.0;  // m, newest of the first radio
  Pose2 truth = {-7.0, -4.0, 0.0};

  DriveAmongRadios() {
    int id = 1;
    for (const auto& [x, y] : {std::pair(-10.0, -7.0), std::pair(10.0, -7.0), std::pair(10.0, 7.0),
                               std::pair(-10.0, 7.0)}) {
      Beacon beacon;
      beacon.id = id++;
      beacon.position = {x, y, 0.0};
      beacon.is_planar = true;
      beacons.push_back(beacon);
    }
  }

  /// Drives for so long (s), hands everything to the memory and lets it solve every five seconds.
  void drive(double duration, unsigned seed, RangeMemory* memory) {
    int steps = 0;
    drive(duration, seed, [&](const OdometryIncrement& increment, const RangeObservation& range) {
      memory->add(increment, {range});
      if (++steps % 50 == 0) memory->solve();
    });
  }

  /// Likewise, to anybody.
  template <typename Take>
  void drive(double duration, unsigned seed, const Take& take) {
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform;
    constexpr double kStep = 0.1;
    double along = -straight;
    int next = 0;
    for (int i = 0; i < static_cast<int>(duration / kStep); ++i) {
      constexpr double kSpeed = 0.5;
      constexpr double kTurnRate = 0.5;
      // Sides of 14 and 8 m, and quarter turns.
      const double length = side_ % 2 == 0 ? 14.0 : 8.0;
      Pose2 motion;
      if (turned_ < 0.0) {
        motion.x = kSpeed * kStep;
        along += motion.x;
        if (along >= length) turned_ = 0.0;
      } else {
        motion.heading = kTurnRate * kStep;
        turned_ += motion.heading;
        if (turned_ >= 0.5 * kPi) {
          turned_ = -1.0;
          along = 0.0;
          ++side_;
        }
      }
      truth = compose(truth, motion);
      Pose2 measured = motion;
      measured.x = distance_scale * motion.x + 0.005 * std::sqrt(kStep) * normal(engine);
      measured.heading = turn_scale * motion.heading;
      measured.heading += yaw_rate_bias * kStep + 0.003 * std::sqrt(kStep) * normal(engine);
      OdometryIncrement increment;
      append(OdometryNoise{}, measured, kStep, &increment);
      const auto radio = static_cast<std::size_t>(next++) % beacons.size();
      const std::size_t heard = static_cast<int>(radio) == radio_that_repeats ? 0 : radio;
      const Pose2 place = compose(truth, {antenna.x(), antenna.y(), 0.0});
      RangeObservation range;
      range.beacon = beacons[radio].id;
      const Eigen::Vector3d from(place.x, place.y, antenna.z());
      range.range = scale * (beacons[heard].position - from).norm() + bias + sigma * normal(engine);
      if (radio + 1 == beacons.size()) range.range += biased;
      if (uniform(engine) < reflected) range.range -= 1.5 * std::log(1.0 - uniform(engine));
      if (wild > 0.0 && uniform(engine) < wild) range.range = 40.0 * uniform(engine);
      if (radio == 0) first_range = range.range;
      if (heard != radio && repeats_exactly) range.range = first_range;
      take(increment, range);
    }
  }

  /// m, of the memory's newest pose.
  double error(const RangeMemory& memory) const {
    const Eigen::VectorXd newest = memory.newest(memory.modes().front()).mean;
    return std::hypot(newest[0] - truth.x, newest[1] - truth.y);
  }

 private:
  int side_ = 0;
  double turned_ = -1.0;
};

}  // namespace pf_resampling
