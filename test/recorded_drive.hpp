#pragma once

#include <geometry_msgs/PointStamped.h>
#include <geometry_msgs/PoseStamped.h>
#include <rosbag/view.h>

#include <string>

#include "pf_resampling_core/test/temporary_directory.hpp"
#include "test/run_program.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/recording.hpp"

namespace pf_resampling {

/// What dataset_to_bag makes of a data set, for instance of "mrclam DIRECTORY".
inline Recording recorded_drive(const std::string& data_set, const std::string& options = "") {
  const TemporaryDirectory directory;
  const std::string path = directory.file("drive.bag");
  const ProgramResult made = run_program("dataset_to_bag " + data_set + " " + path + options);
  if (made.exit_code != 0) throw std::runtime_error(made.error);
  const rosbag::Bag bag = open_bag(path);
  Recording recording = read_recording(bag, "/odom", "/ranges", "/landmarks");
  recording.odometry_noise.reset();  // as these tests assume it
  recording.beacons = read_beacons(bag, "/beacons");
  recording.landmarks =
      read_landmark_map(bag, "/ground_truth_landmarks").value_or(recording.landmarks);
  const auto take = [&](double time, const geometry_msgs::Point& place) {
    if (time < recording.odometry.front().time || time > recording.odometry.back().time) return;
    recording.truth.push_back({time, {place.x, place.y, 0.0}});  // not all have a heading
  };
  for (const auto& message : rosbag::View(bag, rosbag::TopicQuery("/ground_truth"))) {
    const auto pose = message.instantiate<geometry_msgs::PoseStamped>();
    const auto point = message.instantiate<geometry_msgs::PointStamped>();
    if (pose) take(pose->header.stamp.toSec(), pose->pose.position);
    if (point) take(point->header.stamp.toSec(), point->point);
  }
  return recording;
}

}  // namespace pf_resampling
