#include "pf_resampling_core/smoothing/smoothing_graph.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
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

}  // namespace

GaussianPrior prior_at(const Pose2& first, const SensorConstants& sigma) {
  GaussianPrior prior;
  prior.pose = first;
  prior.information.setZero(prior.size(), prior.size());
  prior.information.diagonal().head<3>().setConstant(1.0 / (kFixed * kFixed));
  prior.information.diagonal().tail<kSensorConstants>() =
      sigma.array().max(kSmallestPrior).square().inverse();
  prior.gradient.setZero(prior.size());
  prior.odometry_given_path =
      prior.information.bottomRightCorner<kSensorConstants, kSensorConstants>()
          .topLeftCorner<kOdometryConstants, kOdometryConstants>();
  return prior;
}

std::optional<GaussianPrior> prior_of(const Pose2& pose,
                                      const std::vector<Eigen::Vector2d>& landmarks,
                                      const SensorConstants& constants,
                                      const Eigen::MatrixXd& covariance,
                                      const std::vector<Eigen::Matrix2d>& landmarks_given_path,
                                      const OdometryInformation& odometry_given_path) {
  GaussianPrior prior;
  prior.pose = pose;
  prior.landmarks = landmarks;
  prior.constants = constants;
  const Eigen::LLT<Eigen::MatrixXd> root(covariance);
  if (root.info() != Eigen::Success) return std::nullopt;
  prior.information = root.solve(Eigen::MatrixXd::Identity(prior.size(), prior.size()));
  prior.gradient.setZero(prior.size());
  for (const Eigen::Matrix2d& landmark : landmarks_given_path) {
    prior.landmarks_given_path.push_back(landmark.inverse());
  }
  prior.odometry_given_path = odometry_given_path.inverse();
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
  if (!are_plausible(graph.constants)) {
    throw Error("smoothing: the sensors' constants have to be finite, and no scale below -0.5");
  }
  for (std::size_t i = 0; i < graph.motions.size(); ++i) {
    const MotionFactor& motion = graph.motions[i];
    const bool is_good = is_finite(motion.mean) && motion.covariance.allFinite() &&
                         motion.covariance.diagonal().minCoeff() >= 0.0 &&
                         motion.sensitivity.allFinite();
    if (!is_good) {
      throw Error("smoothing: motion " + std::to_string(i) +
                  " has to be finite, with no negative variance");
    }
  }
  for (std::size_t i = 0; i < graph.sightings.size(); ++i) {
    const SightingFactor& sighting = graph.sightings[i];
    const bool is_good = std::isfinite(sighting.range) && std::isfinite(sighting.bearing) &&
                         sighting.range_variance > 0.0 && std::isfinite(sighting.range_variance) &&
                         sighting.bearing_variance > 0.0 &&
                         std::isfinite(sighting.bearing_variance) && is_finite(sighting.sensor);
    const bool is_there = sighting.pose >= 0 && sighting.landmark >= 0 &&
                          static_cast<std::size_t>(sighting.pose) < graph.poses.size() &&
                          static_cast<std::size_t>(sighting.landmark) < graph.landmarks.size();
    if (!is_good || !is_there) {
      throw Error("smoothing: sighting " + std::to_string(i) + " of landmark " +
                  std::to_string(sighting.landmark) + " from pose " +
                  std::to_string(sighting.pose) +
                  " has to be finite, with positive variances, of a pose and a landmark of the "
                  "graph");
    }
  }
}

}  // namespace pf_resampling
