#pragma once

#include <nav_msgs/Path.h>

#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {

/// The path driven, as poses `spacing` metres, or a turn, apart and not more than `length` of them:
/// when there are too many, every other one is dropped and the spacing doubles.
class PathRecorder {
 public:
  PathRecorder(double spacing, int length) : start_spacing_(spacing), length_(length) { clear(); }

  void clear();
  void add(ros::Time stamp, const std::string& frame, const Pose2& pose);
  const nav_msgs::Path& path() const { return path_; }

 private:
  double start_spacing_;
  double spacing_ = 0.0;
  int length_;
  Pose2 last_;
  nav_msgs::Path path_;
};

}  // namespace pf_resampling
