#include "tools/common/fastslam_bag.hpp"

#include "tools/common/bag.hpp"
#include "tools/common/ordered_bag.hpp"

namespace pf_resampling {

void require_fastslam_topics(const rosbag::Bag& bag, const std::string& path,
                             const FastSlamTopics& topics, bool needs_landmarks) {
  std::vector<NeededTopic> needed = {{topics.odom, {"nav_msgs/Odometry"}, "--odom"}};
  if (needs_landmarks) {
    needed.push_back({topics.landmarks, {"pf_resampling/LandmarkObservationArray"}, "--landmarks"});
  }
  require_topics(bag, path, needed);
}

std::optional<FastSlamMessage> to_fastslam_message(const rosbag::MessageInstance& message,
                                                   const FastSlamTopics& topics) {
  const std::string& topic = message.getTopic();
  if (topic == topics.odom) return instantiate_as<nav_msgs::Odometry, FastSlamMessage>(message);
  if (topic == topics.landmarks) {
    return instantiate_as<LandmarkObservationArray, FastSlamMessage>(message);
  }
  if (topic == topics.initial_pose) {
    return instantiate_as<geometry_msgs::PoseWithCovarianceStamped, FastSlamMessage>(message);
  }
  if (topic == "/tf_static" || topic == "/tf") {
    return instantiate_as<tf2_msgs::TFMessage, FastSlamMessage>(message);
  }
  return std::nullopt;
}

}  // namespace pf_resampling
