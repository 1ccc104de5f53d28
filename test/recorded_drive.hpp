#pragma once

#include <geometry_msgs/PointStamped.h>
#include <geometry_msgs/PoseStamped.h>
#include <rosbag/view.h>

#include <string>
#include <vector>

#include "pf_resampling_core/test/temporary_directory.hpp"
#include "src/messages/conversions.hpp"
#include "test/run_program.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/recording.hpp"

namespace pf_resampling {

/// With the truth, map frame, as far as it is in the bag; nothing says how good its odometry is.
struct KnownDrive : Recording {
  std::vector<StampedPose> truth;  ///< while there is odometry
  std::vector<PointLandmark> landmarks;
};

inline KnownDrive drive_in(const std::string& path) {
  const rosbag::Bag bag = open_bag(path);
  KnownDrive drive;
  static_cast<Recording&>(drive) = read_recording(bag, "/odom", "/ranges", "/landmarks");
  drive.odometry_noise.reset();
  drive.beacons = read_beacons(bag, "/beacons");
  drive.landmarks = read_landmark_map(bag, "/ground_truth_landmarks").value_or(drive.landmarks);
  const auto take = [&](double time, const Pose2& place) {
    if (time < drive.odometry.front().time || time > drive.odometry.back().time) return;
    drive.truth.push_back({time, place});
  };
  for (const auto& message : rosbag::View(bag, rosbag::TopicQuery("/ground_truth"))) {
    const auto pose = message.instantiate<geometry_msgs::PoseStamped>();
    const auto point = message.instantiate<geometry_msgs::PointStamped>();
    if (pose) take(pose->header.stamp.toSec(), to_pose2(pose->pose));
    if (point) take(point->header.stamp.toSec(), {point->point.x, point->point.y, 0.0});
  }
  return drive;
}

/// What dataset_to_bag makes of a data set, for instance of "mrclam DIRECTORY".
inline KnownDrive recorded_drive(const std::string& data_set, const std::string& options = "") {
  const TemporaryDirectory directory;
  const std::string path = directory.file("drive.bag");
  const ProgramResult made = run_program("dataset_to_bag " + data_set + " " + path + options);
  if (made.exit_code != 0) throw std::runtime_error(made.error);
  return drive_in(path);
}

}  // namespace pf_resampling
