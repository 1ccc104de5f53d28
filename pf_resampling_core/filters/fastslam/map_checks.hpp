#pragma once

#include <cstdint>
#include <string>

#include "pf_resampling_core/filters/fastslam/saved_map.hpp"

/// What is wrong with a part of a saved map, in words; nothing if all is well.
namespace pf_resampling::map_checks {

constexpr std::int64_t kLargestId = std::int64_t{1} << 62;

std::string fault_of_pose(const Pose2& pose);
std::string fault_of_pose_covariance(const Eigen::Matrix3d& covariance);
/// `previous`: the id before it in the list, -1 for the first.
std::string fault_of(const SavedLandmark& landmark, std::int64_t previous);

}  // namespace pf_resampling::map_checks
