#pragma once

#include <cstddef>
#include <string>

#include "pf_resampling_core/files/text_file.hpp"

namespace pf_resampling {

/// The tf frames, as in REP 105.
struct FrameNames {
  std::string map = "map";
  std::string odom = "odom";
  std::string base = "base_link";
  bool publish_tf = true;            ///< map -> odom is given out on /tf
  double transform_tolerance = 0.2;  ///< s by which map -> odom is dated into the future
};

/// No name of a frame is longer; what is longer names nothing.
constexpr std::size_t kLongestFrameName = 255;

/// A name as it is told of: the beginning and the length of one that is too long.
inline std::string shown_name(const std::string& name) {
  if (name.size() <= kLongestFrameName) return text_file::in_letters(name);
  return text_file::in_letters(name.substr(0, 40)) + "... (" + std::to_string(name.size()) +
         " characters, at most " + std::to_string(kLongestFrameName) + " make a name)";
}

}  // namespace pf_resampling
