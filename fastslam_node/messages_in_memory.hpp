#pragma once

#include <ros/time.h>

#include <variant>
#include <vector>

#include "fastslam_node/fastslam_pipeline.hpp"

namespace pf_resampling {

/// A message that the pipeline takes in.
using FastSlamMessage =
    std::variant<nav_msgs::Odometry::ConstPtr, LandmarkObservationArray::ConstPtr,
                 geometry_msgs::PoseWithCovarianceStamped::ConstPtr, tf2_msgs::TFMessage::ConstPtr>;

/// Hands a message to the pipeline.
void handle(const FastSlamMessage& message, FastSlamPipeline* pipeline);

}  // namespace pf_resampling
