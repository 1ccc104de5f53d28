#pragma once

#include <rosbag/bag.h>
#include <rosbag/message_instance.h>

#include <optional>
#include <string>
#include <vector>

#include "fastslam_node/fastslam_pipeline.hpp"

namespace pf_resampling {

/// Names of the topics that FastSLAM reads from a bag.
struct FastSlamTopics {
  std::string odom = "/odom";
  std::string landmarks = "/landmarks";
  std::string initial_pose = "/initialpose";

  /// In which messages of the same time are taken.
  std::vector<std::string> order() const {
    return {"/tf_static", "/tf", initial_pose, landmarks, odom};
  }
};

/// Throws Error unless the bag has odometry and, where `needs_landmarks`, landmark observations.
void require_fastslam_topics(const rosbag::Bag& bag, const std::string& path,
                             const FastSlamTopics& topics, bool needs_landmarks);

/// The message as the pipeline takes it; nothing if it takes none of its topic and type.
std::optional<FastSlamMessage> to_fastslam_message(const rosbag::MessageInstance& message,
                                                   const FastSlamTopics& topics);

}  // namespace pf_resampling
