#include "pf_resampling_core/smoothing/smoothing_graph.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

constexpr double kFixed = 1e-6;          // m, rad: the standard deviation of a pose that is known
constexpr double kSmallestPrior = 1e-9;  // of a constant that is known
constexpr double kMostScaleError = 0.9;

bool is_finite(const Pose2& pose) {
  return std::isfinite(pose.x) && std::isfinite(pose.y) && std::isfinite(pose.heading);
}

bool is_usable(const SightingFactor& sighting) {
  return std::isfinite(sighting.range) && std::isfinite(sighting.bearing) &&
         sighting.range_variance > 0.0 && std::isfinite(sighting.range_variance) &&
         sighting.bearing_variance > 0.0 && std::isfinite(sighting.bearing_variance) &&
         is_finite(sighting.sensor);
}

}  // namespace

GaussianPrior prior_at(const Pose2& first, const SensorConstants& sigma) {
  GaussianPrior prior;
  prior.pose = first;
  Eigen::Matrix<double, GaussianPrior::kSize, 1> sigmas;
  sigmas << Eigen::Vector3d::Constant(kFixed), sigma.cwiseMax(kSmallestPrior);
  prior.information = sigmas.cwiseAbs2().cwiseInverse().asDiagonal();
  return prior;
}

bool are_plausible(const SensorConstants& constants) {
  return constants.allFinite() && constants[SensorConstant::distance_scale] > -kMostScaleError &&
         std::abs(1.0 + constants[SensorConstant::turn_scale]) > 1.0 - kMostScaleError &&
         constants[SensorConstant::range_scale] > -kMostScaleError;
}

Pose2 corrected_motion(const MotionFactor& motion, const SensorConstants& constants) {
  const Eigen::Vector3d change = motion.sensitivity * constants.head<kOdometryConstants>();
  return {motion.mean.x + change.x(), motion.mean.y + change.y(),
          wrap_angle(motion.mean.heading + change.z())};
}

void check(const SmoothingGraph& graph) {
  if (graph.poses.empty() || graph.motions.size() + 1 != graph.poses.size()) {
    throw Error("smoothing: " + std::to_string(graph.poses.size()) + " poses and " +
                std::to_string(graph.motions.size()) +
                " motions; a graph needs one motion from each pose to the next");
  }
  const auto are_finite = [](const auto& list, const auto& test) {
    return std::all_of(list.begin(), list.end(), test);
  };
  if (!are_finite(graph.poses, [](const Pose2& pose) { return is_finite(pose); }) ||
      !are_finite(graph.landmarks, [](const Eigen::Vector2d& one) { return one.allFinite(); })) {
    throw Error("smoothing: the estimate of every pose and landmark has to be finite");
  }
  if (!are_plausible(graph.constants)) {
    throw Error("smoothing: the sensors' constants have to be finite, and no scale near -1");
  }
  for (std::size_t i = 0; i < graph.motions.size(); ++i) {
    const MotionFactor& motion = graph.motions[i];
    const bool is_good =
        is_finite(motion.mean) && motion.covariance.allFinite() &&
        motion.covariance.diagonal().minCoeff() >= 0.0 && motion.slip_covariance.allFinite() &&
        motion.slip_covariance.diagonal().minCoeff() >= 0.0 && motion.sensitivity.allFinite();
    if (!is_good) {
      throw Error("smoothing: motion " + std::to_string(i) +
                  " has to be finite, with no negative variance");
    }
  }
  const auto is_there = [](int number, std::size_t count) {
    return number >= 0 && static_cast<std::size_t>(number) < count;
  };
  for (std::size_t i = 0; i < graph.sightings.size(); ++i) {
    const SightingFactor& sighting = graph.sightings[i];
    if (!is_usable(sighting) || !is_there(sighting.pose, graph.poses.size()) ||
        !is_there(sighting.landmark, graph.landmarks.size())) {
      throw Error("smoothing: sighting " + std::to_string(i) + " of landmark " +
                  std::to_string(sighting.landmark) + " from pose " +
                  std::to_string(sighting.pose) +
                  " has to be finite, with positive variances, of a pose and a landmark of the "
                  "graph");
    }
  }
}

}  // namespace pf_resampling
