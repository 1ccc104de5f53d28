#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace pf_resampling {

/// A message of a type that is not known when this is compiled, read by the definition that comes
/// with it, in the header of its connection, live and in bags. `type`:
/// "apriltag_ros/AprilTagDetectionArray"; `definition`: its text and those of all types in it, as
/// ROS puts them together. Times and durations become {"secs": ..., "nsecs": ...}. Throws Error if
/// they do not describe `size` bytes at `data`.
nlohmann::json read_described(const std::string& type, const std::string& definition,
                              const std::uint8_t* data, std::size_t size);

}  // namespace pf_resampling
