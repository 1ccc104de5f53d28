#pragma once

#include <cstdint>
#include <string>

#include "pf_resampling_core/filters/fastslam/saved_map.hpp"

/// What is wrong with a part of a saved map, in words; nothing if all is well. Shared by the reader
/// of files, which knows the line, and by check_saved_map().
namespace pf_resampling::map_checks {

constexpr std::int64_t kLargestId = std::int64_t{1} << 62;
constexpr std::int64_t kMostParticles = 1000000;

std::string fault_of_frame(const std::string& frame);
std::string fault_of_pose(const Pose2& pose);
std::string fault_of_pose_covariance(const Eigen::Matrix3d& covariance);
std::string fault_of_view(double range, double bearing);
/// `previous`: the id before it in the list, -1 for the first.
std::string fault_of(const SavedLandmark& landmark, std::int64_t previous);
/// Its pose and weights.
std::string fault_of(const FastSlamParticles& particles, Eigen::Index particle);
/// `map`: with the landmarks that particles can have.
std::string fault_of(const ParticleLandmark& landmark, std::int64_t previous, const SavedMap& map);
/// Of so many particles.
std::string fault_of(const OdometryErrorState& errors, std::size_t particles);
/// What shows only when all is there: weights together, the next id.
std::string fault_of_whole(const SavedMap& map);

}  // namespace pf_resampling::map_checks
