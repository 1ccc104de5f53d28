#include "pf_resampling_core/smoothing/smoothing_graph.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

constexpr double kFixed = 1e-6;          // m, rad: the standard deviation of a pose that is known
constexpr double kSmallestPrior = 1e-9;  // of a constant that is known

bool is_finite(const Pose2& pose) {
  return std::isfinite(pose.x) && std::isfinite(pose.y) && std::isfinite(pose.heading);
}

bool is_usable(const SightingFactor& sighting) {
  return std::isfinite(sighting.range) && std::isfinite(sighting.bearing) &&
         sighting.range_variance > 0.0 && std::isfinite(sighting.range_variance) &&
         sighting.bearing_variance > 0.0 && std::isfinite(sighting.bearing_variance) &&
         is_finite(sighting.sensor);
}

bool is_usable(const RangeFactor& range) {
  return std::isfinite(range.range) && range.variance > 0.0 && std::isfinite(range.variance) &&
         std::isfinite(range.height) && range.beacon.allFinite() && range.antenna.allFinite();
}

}  // namespace

GaussianPrior prior_at(const Pose2& first, const SensorConstants& sigma) {
  return prior_among_radios(first, Eigen::Vector3d::Constant(kFixed), sigma, 0, {});
}

GaussianPrior prior_among_radios(const Pose2& first, const Eigen::Vector3d& first_sigma,
                                 const SensorConstants& sigma, int radios,
                                 const RadioPrior& prior_of_radios) {
  GaussianPrior prior;
  prior.pose = first;
  prior.radios.assign(static_cast<std::size_t>(radios), Eigen::Vector2d::Zero());
  Eigen::VectorXd sigmas = Eigen::VectorXd::Ones(prior.size());
  sigmas.head<3>() = first_sigma;
  sigmas.tail<kSensorConstants>() = sigma.cwiseMax(kSmallestPrior);
  prior.information = sigmas.cwiseAbs2().cwiseInverse().asDiagonal();
  // The inverse of own²·I + common²·(all ones), by Sherman and Morrison's formula.
  const Eigen::Array2d own = prior_of_radios.own.array().square();
  const Eigen::Array2d common = prior_of_radios.common.array().square();
  const Eigen::Array2d shared = common / (own * (own + radios * common));
  for (Eigen::Index i = 0; i < radios; ++i) {
    for (Eigen::Index j = 0; j < radios; ++j) {
      prior.information.block<2, 2>(3 + 2 * i, 3 + 2 * j) = (-shared).matrix().asDiagonal();
      if (i != j) continue;
      prior.information.diagonal().segment<2>(3 + 2 * i) += own.inverse().matrix();
    }
  }
  prior.gradient.setZero(prior.size());
  return prior;
}

bool are_plausible(const SensorConstants& constants) {
  return constants.allFinite() && constants[SensorConstant::distance_scale] > -0.5 &&
         constants[SensorConstant::turn_scale] > -0.5 &&
         constants[SensorConstant::range_scale] > -0.5;
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
  if (!are_finite(graph.radios, [](const Eigen::Vector2d& one) { return one.allFinite(); }) ||
      graph.prior.radios.size() != graph.radios.size()) {
    throw Error(
        "smoothing: the errors of every radio have to be finite, and the prior has to have "
        "as many radios as the graph");
  }
  if (!are_plausible(graph.constants)) {
    throw Error("smoothing: the sensors' constants have to be finite, and no scale below -0.5");
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
  for (std::size_t i = 0; i < graph.ranges.size(); ++i) {
    const RangeFactor& range = graph.ranges[i];
    if (!is_usable(range) || !is_there(range.pose, graph.poses.size()) ||
        !is_there(range.radio, graph.radios.size())) {
      throw Error(
          "smoothing: range " + std::to_string(i) + " of radio " + std::to_string(range.radio) +
          " from pose " + std::to_string(range.pose) +
          " has to be finite, with a positive variance, of a pose and a radio of the graph");
    }
  }
}

}  // namespace pf_resampling
