#pragma once

#include <cstdint>

namespace pf_resampling::checkpoint_lines {

inline constexpr const char* kBeaconMcl = "beacon_mcl";
inline constexpr const char* kFastSlam = "fastslam";
inline constexpr std::int64_t kNanoseconds = 1000000000;
inline constexpr std::int64_t kLatest = 0x7fffffff;  // s, that ROS 1 can reckon with

}  // namespace pf_resampling::checkpoint_lines
