#pragma once

#include <string>

namespace pf_resampling {

/// The tf frames, as in REP 105.
struct FrameNames {
  std::string map = "map";
  std::string odom = "odom";
  std::string base = "base_link";
  bool publish_tf = true;            ///< map -> odom is given out on /tf
  double transform_tolerance = 0.2;  ///< s by which map -> odom is dated into the future
};

}  // namespace pf_resampling
