#include "pf_resampling_core/filters/fastslam/map_checks.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <set>

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
  const std::string id = std::to_string(estimate.id);
  if (estimate.id < 0 || estimate.id > kLargestId) {
    return "landmark id " + id + " is not in [0, 2^62]";
  }
  if (estimate.id == previous) return "landmark " + id + " is there twice";
  if (estimate.id < previous) {
    return "landmark " + id + " comes after landmark " + std::to_string(previous) +
           "; ids must ascend";
  }
  if (!is_place(estimate.mean)) {
    return "the position of landmark " + id + " is not finite or beyond 1e9 m";
  }
  if (!is_covariance(estimate.covariance)) {
    return "the covariance of landmark " + id + " is not positive definite, or beyond 1e18 m^2";
  }
  return {};
}

}  // namespace map_checks

std::string fault_of(const SavedMap& map) {
  using namespace map_checks;
  std::string fault = fault_of_pose(map.pose.mean);
  if (fault.empty()) fault = fault_of_pose_covariance(map.pose.covariance);
  if (!fault.empty()) return fault;
  if (!(map.view_range >= 0.0 && map.view_range <= kWidestView)) {
    return "the farthest range seen is not in [0, 1e6] m";
  }
  if (!(map.view_bearing >= 0.0 && map.view_bearing <= kPi + kRounding)) {
    return "the widest bearing seen is not in [0, pi]";
  }
  std::set<std::int64_t> ids;
  for (const SavedLandmark& landmark : map.landmarks) {
    fault = fault_of(landmark, ids.empty() ? -1 : *ids.rbegin());
    if (!fault.empty()) return fault;
    ids.insert(ids.end(), landmark.estimate.id);
  }
  if (map.association == DataAssociation::automatic && !ids.empty()) {
    return "there are landmarks, but association is automatic, which leaves open what their ids "
           "mean";
  }
  for (const std::vector<ParticleLandmark>& landmarks : map.particle_maps) {
    for (const ParticleLandmark& landmark : landmarks) {
      if (ids.count(landmark.id) > 0) continue;
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
