#pragma once

#include "pf_resampling_core/filters/fastslam/memory/segment_graph.hpp"

namespace pf_resampling {

/// Scales of the odometry that are far from 1, from landmarks alone: of each landmark that is seen
/// from two poses within a second, how it moved on the robot says how far the robot drove and
/// turned. Needs no map and no first guess, so it finds what least squares of the whole drive do
/// not: a gyro with the wrong sign, wheels that count four times too much.
/// Returns true over measured, less 1 (0 where that is small, or not known well), as
/// SensorConstant::distance_scale and turn_scale.
/// `open`: what came since the last segment.
Eigen::Vector2d gross_odometry_scales(const SegmentGraph& graph, const Segment& open);

}  // namespace pf_resampling
