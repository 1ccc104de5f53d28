#include "research/studies/recorded_drive.hpp"

#include "pf_resampling_core/error.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/bag_contents.hpp"

namespace pf_resampling {
namespace {

template <typename Message>
bool take(const rosbag::MessageInstance& message, RecordedDrive* drive) {
  const auto pointer = message_in<Message>(message);
  if (pointer) drive->messages.emplace_back(*pointer);
  return pointer != nullptr;
}

}  // namespace

RecordedDrive read_drive(const std::string& path) {
  const rosbag::Bag bag = open_bag(path);
  require_topics(bag, path,
                 {{"/odom", {"nav_msgs/Odometry"}, ""}, {"/ground_truth", truth_types(), ""}});
  RecordedDrive drive;
  int observations = 0;
  for_each_in_order(
      bag, path, {"/tf_static", "/tf", "/beacons", "/ranges", "/landmarks", "/odom"},
      [&](const rosbag::MessageInstance& message) {
        const std::string& topic = message.getTopic();
        if (topic == "/odom") take<nav_msgs::Odometry>(message, &drive);
        if (topic == "/beacons") take<BeaconArray>(message, &drive);
        if (topic == "/tf_static") take<tf2_msgs::TFMessage>(message, &drive);
        if (topic == "/ranges" && take<BeaconRange>(message, &drive)) ++observations;
        if (topic == "/landmarks" && take<LandmarkObservationArray>(message, &drive)) {
          ++observations;
        }
      });
  if (observations == 0)
    throw Error(path + ": there is neither a message on /ranges nor on /landmarks");
  drive.truth = truth_while_recording(read_truth(bag, "/ground_truth"), read_poses(bag, "/odom"));
  drive.beacons = read_beacons(bag, "/beacons");
  drive.landmarks = read_landmark_map(bag, "/ground_truth_landmarks").value_or(drive.landmarks);
  return drive;
}

ros::Time stamp_of(const DriveMessage& message) {
  if (const auto* odometry = std::get_if<nav_msgs::Odometry>(&message)) {
    return odometry->header.stamp;
  }
  if (const auto* range = std::get_if<BeaconRange>(&message)) return range->header.stamp;
  if (const auto* scan = std::get_if<LandmarkObservationArray>(&message)) {
    return scan->header.stamp;
  }
  return {};
}

}  // namespace pf_resampling
