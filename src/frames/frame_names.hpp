#pragma once

#include <string>

#include "pf_resampling_core/parameters/parameters.hpp"

namespace pf_resampling {

/// The tf frames, as in REP 105.
struct FrameNames {
  std::string map = "map";
  std::string odom = "odom";
  std::string base = "base_link";
  double transform_tolerance = 0.2;  ///< s by which map -> odom is dated into the future
};

/// Adds them as parameters, in the group "frames".
void add_parameters(FrameNames* frames, ParameterList* list);

}  // namespace pf_resampling
