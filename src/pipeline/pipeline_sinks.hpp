#pragma once

#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/PoseArray.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <nav_msgs/Path.h>
#include <pf_resampling/FilterStatus.h>
#include <sensor_msgs/PointCloud2.h>
#include <visualization_msgs/MarkerArray.h>

#include <functional>
#include <string>

#include "pf_resampling_core/population/pose_estimate.hpp"
#include "src/diagnostics/log_level.hpp"

namespace pf_resampling {

/// Where the messages of a pipeline go. What is empty is not made at all.
struct PipelineSinks {
  std::function<void(ros::Time, const PoseEstimate&)> estimate;  ///< what `pose` says, as numbers
  std::function<void(const geometry_msgs::PoseWithCovarianceStamped&)> pose;
  std::function<void(const nav_msgs::Path&)> path;
  std::function<void(const geometry_msgs::PoseArray&)> particlecloud;
  std::function<void(const sensor_msgs::PointCloud2&)> particles;
  std::function<void(const visualization_msgs::MarkerArray&)> markers;
  std::function<void(const FilterStatus&)> status;
  std::function<void(const diagnostic_msgs::DiagnosticArray&)> diagnostics;
  /// Called before diagnostics are given out, to add entries to them.
  std::function<void(diagnostic_msgs::DiagnosticArray*)> more_diagnostics;
  std::function<void(const geometry_msgs::TransformStamped&)> transform;  ///< map -> odom
  std::function<void(LogLevel, const std::string&)> log;
  /// Whether anybody looks at the hypotheses in status and markers; empty: yes.
  std::function<bool()> wants_hypotheses;
  /// Seconds since some time, to measure updates with. Empty in runs that have to be reproducible:
  /// they report an update time of 0.
  std::function<double()> stopwatch;
};

}  // namespace pf_resampling
