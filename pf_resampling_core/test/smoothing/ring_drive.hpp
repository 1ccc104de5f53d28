#pragma once

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "pf_resampling_core/population/random_stream.hpp"
#include "pf_resampling_core/smoothing/smoother.hpp"
#include "pf_resampling_core/smoothing/smoothing_graph.hpp"

namespace pf_resampling {

/// A robot that drives in a circle of 10 m radius (of more for more than 60 landmarks), a third of
/// a metre from pose to pose, past landmarks inside and outside of it, with white noise of 2 cm and
/// 0.01 rad a step and 5 cm and 0.02 rad a sighting. It starts at the origin, which it comes back
/// to.
struct RingDrive {
  SmoothingGraph truth;
  SmoothingGraph graph;  ///< data, and dead reckoning as the estimate

  RingDrive(int poses, int landmarks, std::uint64_t seed, const SensorConstants& sigma,
            const SensorConstants& errors = SensorConstants::Zero()) {
    const RandomStream random(seed, RandomPurpose::test, 0);
    std::uint64_t next = 0;
    const auto noise = [&](double s) { return s * random.normal(next++); };
    constexpr double kSee = 6.0;  // m
    const double radius = std::max(10.0, landmarks / 6.0);
    const double turn = 0.1 * kPi / radius;
    truth.constants = errors;
    for (int l = 0; l < landmarks; ++l) {
      const double angle = 2.0 * kPi * l / landmarks;
      const double off = l % 2 == 0 ? radius - 2.0 : radius + 3.0;
      truth.landmarks.emplace_back(off * std::sin(angle), radius - off * std::cos(angle));
    }
    truth.poses = {Pose2{}};
    graph.poses = {Pose2{}};
    graph.prior = prior_at(Pose2{}, sigma);
    std::vector<int> number(static_cast<std::size_t>(landmarks), -1);
    for (int i = 1; i < poses; ++i) {
      const Pose2 step = {0.1 * kPi, 0.0, turn};
      truth.poses.push_back(compose(truth.poses.back(), step));
      MotionFactor motion;
      motion.covariance.diagonal() << 4e-4, 4e-4, 1e-4;
      // Of distance scale, turn scale and yaw rate (a second per step).
      motion.sensitivity(0, SensorConstant::distance_scale) = step.x;
      motion.sensitivity(2, SensorConstant::turn_scale) = turn;
      motion.sensitivity(2, SensorConstant::yaw_rate) = 1.0;
      motion.mean = {step.x / (1.0 + errors[SensorConstant::distance_scale]) + noise(0.02),
                     noise(0.02),
                     turn / (1.0 + errors[SensorConstant::turn_scale]) -
                         errors[SensorConstant::yaw_rate] + noise(0.01)};
      motion.sensitivity(0, SensorConstant::distance_scale) = motion.mean.x;
      motion.sensitivity(2, SensorConstant::turn_scale) = motion.mean.heading;
      graph.motions.push_back(motion);
      graph.poses.push_back(compose(graph.poses.back(), motion.mean));
      for (int l = 0; l < landmarks; ++l) {
        const Eigen::Vector2d& place = truth.landmarks[static_cast<std::size_t>(l)];
        const Pose2 seen = relative(truth.poses.back(), {place.x(), place.y(), 0.0});
        const double range = std::hypot(seen.x, seen.y);
        if (range > kSee || i % 2 == 1) continue;
        SightingFactor sighting;
        sighting.pose = i;
        sighting.range = (1.0 + errors[SensorConstant::range_scale]) * range + noise(0.05);
        sighting.bearing = wrap_angle(std::atan2(seen.y, seen.x) +
                                      errors[SensorConstant::bearing_bias] + noise(0.02));
        sighting.range_variance = 25e-4;
        sighting.bearing_variance = 4e-4;
        int& at = number[static_cast<std::size_t>(l)];
        if (at < 0) {
          at = static_cast<int>(graph.landmarks.size());
          order.push_back(l);
          const double direction = graph.poses.back().heading + sighting.bearing;
          graph.landmarks.emplace_back(graph.poses.back().x + sighting.range * std::cos(direction),
                                       graph.poses.back().y + sighting.range * std::sin(direction));
        }
        sighting.landmark = at;
        graph.sightings.push_back(sighting);
      }
    }
  }

  std::vector<int> order;  ///< true landmark of each of the graph's
};

/// Covariance of landmarks, constants and newest pose, in this order, at the estimate.
inline Eigen::MatrixXd joint_covariance(const SmoothingGraph& graph, double robust_width) {
  const Eigen::SparseMatrix<double> information = information_of(graph, robust_width);
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> root(information);
  const Eigen::Index poses = 3 * static_cast<Eigen::Index>(graph.poses.size());
  const Eigen::Index others = information.cols() - poses;
  Eigen::MatrixXd wanted = Eigen::MatrixXd::Zero(information.cols(), others + 3);
  wanted.bottomLeftCorner(others, others).setIdentity();
  wanted.block<3, 3>(poses - 3, others).setIdentity();
  return wanted.transpose() * root.solve(wanted);
}

}  // namespace pf_resampling
