#include "pf_resampling_core/filters/fastslam/map_checks.hpp"
#include "pf_resampling_core/filters/fastslam/memory/saved_memory.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace map_checks {
namespace {

constexpr double kRounding = 1e-9;
constexpr std::int64_t kMostParticles = 1000000;
constexpr double kWidestView = 1e6;  // m, as for sensor/maximum_range

bool is_place(const Eigen::Vector2d& place) {
  return std::abs(place.x()) <= kFarthestPosition && std::abs(place.y()) <= kFarthestPosition;
}

// Positive definite, but for rounding: a long thin ellipse may be degenerate in doubles.
bool is_covariance(const Eigen::Matrix2d& c) {
  return c(0, 0) > 0.0 && c(1, 1) > 0.0 && c(0, 0) <= kFarthestPosition * kFarthestPosition &&
         c(1, 1) <= kFarthestPosition * kFarthestPosition && c(0, 1) == c(1, 0) &&
         std::abs(c(0, 1)) <= (1.0 + kRounding) * std::sqrt(c(0, 0)) * std::sqrt(c(1, 1));
}

std::string fault_of_id(std::int64_t id, std::int64_t previous) {
  if (id < 0 || id > kLargestId) {
    return "landmark id " + std::to_string(id) + " is not in [0, 2^62]";
  }
  if (id == previous) return "landmark " + std::to_string(id) + " is there twice";
  if (id < previous) {
    return "landmark " + std::to_string(id) + " comes after landmark " + std::to_string(previous) +
           "; ids must ascend";
  }
  return {};
}

std::string fault_of_gaussian(std::int64_t id, const Eigen::Vector2d& mean,
                              const Eigen::Matrix2d& covariance) {
  if (!is_place(mean)) {
    return "the position of landmark " + std::to_string(id) + " is not finite or beyond 1e9 m";
  }
  if (!is_covariance(covariance)) {
    return "the covariance of landmark " + std::to_string(id) +
           " is not positive definite, or beyond 1e18 m^2";
  }
  return {};
}

bool has(const SavedMap& map, std::int64_t id) {
  const auto found = std::lower_bound(map.landmarks.begin(), map.landmarks.end(), id,
                                      [](const SavedLandmark& landmark, std::int64_t value) {
                                        return landmark.estimate.id < value;
                                      });
  return found != map.landmarks.end() && found->estimate.id == id;
}

std::string fault_of_frame(const std::string& frame) {
  const bool is_name = !frame.empty() && frame.size() <= 255 && frame.front() != '#' &&
                       std::all_of(frame.begin(), frame.end(),
                                   [](char letter) { return letter > ' ' && letter < '\x7f'; });
  return is_name ? "" : "the name of the frame must have 1 to 255 characters and no spaces";
}

std::string fault_of_view(double range, double bearing) {
  if (!(range >= 0.0 && range <= kWidestView))
    return "the farthest range seen is not in [0, 1e6] m";
  if (!(bearing >= 0.0 && bearing <= kPi + kRounding)) {
    return "the widest bearing seen is not in [0, pi]";
  }
  return {};
}

}  // namespace

std::string fault_of_pose(const Pose2& pose) {
  if (!is_place({pose.x, pose.y})) return "the pose is not finite or beyond 1e9 m";
  if (!(std::abs(pose.heading) <= kPi + kRounding)) return "the heading is not in [-pi, pi]";
  return {};
}

std::string fault_of_pose_covariance(const Eigen::Matrix3d& covariance) {
  const char* const fault = "the covariance of the pose is not positive semidefinite";
  if (!covariance.allFinite() || covariance != covariance.transpose()) return fault;
  if (!(covariance.diagonal().maxCoeff() <= kFarthestPosition * kFarthestPosition)) return fault;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance, Eigen::EigenvaluesOnly);
  const double largest = std::max(0.0, solver.eigenvalues().maxCoeff());
  return solver.eigenvalues().minCoeff() >= -kRounding * largest ? "" : fault;
}

std::string fault_of(const SavedLandmark& landmark, std::int64_t previous) {
  const LandmarkEstimate& estimate = landmark.estimate;
  std::string fault = fault_of_id(estimate.id, previous);
  if (fault.empty()) fault = fault_of_gaussian(estimate.id, estimate.mean, estimate.covariance);
  if (!fault.empty()) return fault;
  const std::string name = " of landmark " + std::to_string(estimate.id);
  if (!(estimate.held >= 0.0 && estimate.held <= 1.0 + kRounding)) {
    return "the share that holds it" + name + " is not in [0, 1]";
  }
  if (!std::isfinite(estimate.log_odds)) return "the log-odds" + name + " are not finite";
  if (!is_place(landmark.last_seen)) {
    return "the last place" + name + " is not finite or beyond 1e9 m";
  }
  return {};
}

namespace {

std::string fault_of(const FastSlamParticles& particles, Eigen::Index i) {
  std::string fault = fault_of_pose({particles.x[i], particles.y[i], particles.heading[i]});
  if (!fault.empty()) return fault;
  const double log_weight = particles.log_weight[i];
  const double weight = particles.weight[i];
  // Minus infinity is the logarithm of a weight of zero.
  if (!(log_weight <= kRounding)) return "the log-weight is above 0";
  if (!(std::abs(std::exp(log_weight) - weight) <= kRounding && weight >= 0.0)) {
    return "the weight does not match its logarithm";
  }
  FastSlamParticles::for_each_column(
      particles, [&](const std::string& name, ColumnKind kind, const auto& column) {
        if (kind == ColumnKind::log_weight || kind == ColumnKind::ancestor) return;
        if (!std::isfinite(static_cast<double>(column[i])))
          fault = "the " + name + " is not finite";
      });
  return fault;
}

std::string fault_of(const OdometryErrorState& errors, std::size_t particles) {
  if (errors.means.rows() != static_cast<Eigen::Index>(particles) ||
      (particles > 0 && errors.means.cols() != OdometryErrorEstimator::kCount)) {
    return "the errors of the odometry are not " + std::to_string(OdometryErrorEstimator::kCount) +
           " numbers per particle";
  }
  // Squares of what is larger could be too large for a double.
  constexpr double kLargest = kFarthestPosition;
  if (!(errors.means.abs() <= kLargest).all() ||
      !(errors.velocity.array().abs() <= kLargest).all()) {
    return "the errors of the odometry, or its velocity, are not finite or beyond 1e9";
  }
  const OdometryErrorEstimator::Matrix& covariance = errors.covariance;
  const char* const fault =
      "the covariance of the errors of the odometry is not positive semidefinite";
  if (!covariance.allFinite() || covariance != covariance.transpose()) return fault;
  if (!(covariance.diagonal().maxCoeff() <= kLargest * kLargest)) {
    return "the covariance of the errors of the odometry is beyond 1e18";
  }
  const Eigen::SelfAdjointEigenSolver<OdometryErrorEstimator::Matrix> solver(
      covariance, Eigen::EigenvaluesOnly);
  const double largest = std::max(0.0, solver.eigenvalues().maxCoeff());
  return solver.eigenvalues().minCoeff() >= -kRounding * largest ? "" : fault;
}

std::string fault_of(const ParticleLandmark& landmark, std::int64_t previous, const SavedMap& map) {
  std::string fault = fault_of_id(landmark.id, previous);
  if (fault.empty()) fault = fault_of_gaussian(landmark.id, landmark.mean, landmark.covariance);
  if (!fault.empty()) return fault;
  if (!std::isfinite(landmark.log_odds)) {
    return "the log-odds of landmark " + std::to_string(landmark.id) + " are not finite";
  }
  if (!has(map, landmark.id)) {
    return "landmark " + std::to_string(landmark.id) + " is not in the list of landmarks";
  }
  return {};
}

std::string fault_of_whole(const SavedMap& map) {
  if (map.next_id < 0 || map.next_id > kLargestId + 1) return "the next id is not in [0, 2^62 + 1]";
  if (map.observations_since_renewal < 0) return "the scans since the last renewal are negative";
  if (map.observations_since_redraw < 0) return "the scans since the last redraw are negative";
  if (map.association == DataAssociation::automatic && !map.landmarks.empty()) {
    return "there are landmarks, but association is automatic, which leaves open what their ids "
           "mean";
  }
  const bool by_discovery = map.association != DataAssociation::known;
  if (by_discovery && !map.landmarks.empty() && map.landmarks.back().estimate.id >= map.next_id) {
    return "the next id is already that of a landmark";
  }
  if (map.particles.size() == 0) return {};
  if (map.particles.size() > kMostParticles) {
    return "there are more than 1000000 particles";
  }
  if (!(std::abs(map.particles.weight.sum() - 1.0) <= 1e-6))
    return "the weights do not add up to 1";
  return {};
}

std::string fault_of_population(const SavedMap& map) {
  const Eigen::Index particles = map.particles.size();
  if (map.particle_maps.size() != static_cast<std::size_t>(particles)) {
    return "there are " + std::to_string(map.particle_maps.size()) + " maps of particles for " +
           std::to_string(particles) + " particles";
  }
  if (particles == 0) return {};
  FastSlamParticles saved = map.particles;
  saved.ancestor.setZero(particles);  // is not saved
  std::string fault = fault_of_sizes(saved);
  for (Eigen::Index i = 0; i < particles && fault.empty(); ++i) {
    fault = fault_of(map.particles, i);
    std::int64_t previous = -1;
    for (const ParticleLandmark& landmark : map.particle_maps[static_cast<std::size_t>(i)]) {
      if (fault.empty()) fault = fault_of(landmark, previous, map);
      previous = landmark.id;
    }
    if (!fault.empty()) fault = "particle " + std::to_string(i) + ": " + fault;
  }
  return fault;
}

}  // namespace
}  // namespace map_checks

std::string fault_of(const SavedMap& map) {
  using namespace map_checks;
  std::string fault = fault_of_frame(map.frame);
  if (fault.empty()) fault = fault_of_pose(map.pose.mean);
  if (fault.empty()) fault = fault_of_pose_covariance(map.pose.covariance);
  if (fault.empty()) fault = fault_of_view(map.view_range, map.view_bearing);
  std::int64_t previous = -1;
  for (const SavedLandmark& landmark : map.landmarks) {
    if (fault.empty()) fault = fault_of(landmark, previous);
    previous = landmark.estimate.id;
  }
  if (fault.empty()) fault = fault_of_population(map);
  if (fault.empty()) fault = fault_of(map.odometry_errors, map.particle_maps.size());
  if (fault.empty()) fault = fault_of(map.memory);
  return fault.empty() ? fault_of_whole(map) : fault;
}

void check_saved_map(const SavedMap& map) {
  const std::string fault = fault_of(map);
  if (!fault.empty()) throw Error("map: " + fault + "; save the map again or repair it");
}

}  // namespace pf_resampling
