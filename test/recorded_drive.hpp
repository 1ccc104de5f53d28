#pragma once

#include <cmath>
#include <string>

#include "pf_resampling_core/test/temporary_directory.hpp"
#include "test/run_program.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/bag_contents.hpp"
#include "tools/worlds/recording.hpp"

namespace pf_resampling {

/// What dataset_to_bag makes of a data set, for instance of "mrclam DIRECTORY".
inline Recording recorded_drive(const std::string& data_set, const std::string& options = "") {
  const TemporaryDirectory directory;
  const std::string path = directory.file("drive.bag");
  const ProgramResult made = run_program("dataset_to_bag " + data_set + " " + path + options);
  if (made.exit_code != 0) throw std::runtime_error(made.error);
  const rosbag::Bag bag = open_bag(path);
  Recording recording;
  for (const auto& pose : read_poses(bag, "/odom")) {
    recording.odometry.push_back({pose.time, pose.pose, {}});
  }
  for (const auto& range : read_ranges(bag, "/ranges")) {
    recording.ranges.push_back({range.time, range.beacon, range.range, 0.0, range.frame});
  }
  for (const Beacon& beacon : read_beacons(bag, "/beacons")) {
    recording.beacons.push_back({beacon.id, beacon.position.x(), beacon.position.y(), {}});
  }
  for (const StampedScan& scan : read_landmark_scans(bag, "/landmarks")) {
    for (const SeenLandmark& seen : scan.landmarks) {
      recording.landmark_observations.push_back({scan.time, seen.id, seen.range, seen.bearing,
                                                 seen.range_variance, seen.bearing_variance});
    }
  }
  for (const PointLandmark& mark :
       read_landmark_map(bag, "/ground_truth_landmarks").value_or(std::vector<PointLandmark>())) {
    recording.landmarks.push_back({mark.id, mark.position.x(), mark.position.y()});
  }
  for (const TruePose& truth : read_truth(bag, "/ground_truth")) {
    recording.truth.push_back(
        {truth.time, {truth.x, truth.y, truth.heading.value_or(std::nan(""))}});
  }
  return recording;
}

}  // namespace pf_resampling
