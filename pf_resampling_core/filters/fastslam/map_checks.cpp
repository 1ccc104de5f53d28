#include "pf_resampling_core/filters/fastslam/map_checks.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace map_checks {
namespace {

constexpr double kRounding = 1e-9;
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
  const std::string fault = fault_of_id(estimate.id, previous);
  return !fault.empty() ? fault
                        : fault_of_gaussian(estimate.id, estimate.mean, estimate.covariance);
}

}  // namespace map_checks

std::string fault_of(const SavedMap& map) {
  using namespace map_checks;
  std::string fault = fault_of_pose(map.pose.mean);
  if (fault.empty()) fault = fault_of_pose_covariance(map.pose.covariance);
  if (fault.empty()) fault = fault_of_view(map.view_range, map.view_bearing);
  std::int64_t previous = -1;
  for (const SavedLandmark& landmark : map.landmarks) {
    if (fault.empty()) fault = fault_of(landmark, previous);
    previous = landmark.estimate.id;
  }
  if (!fault.empty()) return fault;
  if (map.association == DataAssociation::automatic && !map.landmarks.empty()) {
    return "there are landmarks, but association is automatic, which leaves open what their ids "
           "mean";
  }
  for (const std::vector<ParticleLandmark>& landmarks : map.particle_maps) {
    for (const ParticleLandmark& landmark : landmarks) {
      if (has(map, landmark.id)) continue;
      return "landmark " + std::to_string(landmark.id) +
             " of the particles is not in the list of landmarks";
    }
  }
  return {};
}

void check_saved_map(const SavedMap& map) {
  const std::string fault = fault_of(map);
  if (!fault.empty()) throw Error("map: " + fault + "; save the map again or repair it");
}

}  // namespace pf_resampling
