#pragma once

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>
#include <pf_resampling/BeaconArray.h>
#include <pf_resampling/BeaconRange.h>
#include <pf_resampling/LandmarkObservationArray.h>
#include <ros/time.h>
#include <tf2_msgs/TFMessage.h>

#include <string>
#include <variant>
#include <vector>

#include "pf_resampling_core/evaluation/map_errors.hpp"
#include "pf_resampling_core/evaluation/stamped_path.hpp"
#include "pf_resampling_core/models/beacon_range.hpp"

namespace pf_resampling {

/// Any message that a filter takes in.
using DriveMessage = std::variant<nav_msgs::Odometry, BeaconRange, BeaconArray,
                                  LandmarkObservationArray, tf2_msgs::TFMessage>;

/// A drive in memory: what came, in its order, and where the robot truly was.
struct RecordedDrive {
  std::vector<DriveMessage> messages;
  std::vector<TruePose> truth;
  std::vector<Beacon> beacons;           ///< empty on a drive among landmarks
  std::vector<PointLandmark> landmarks;  ///< where they are, if the recording says so
};

/// Reads odometry, ranges and beacons, or landmark observations, transforms and the truth from a
/// bag with the usual topics. Throws Error that names the file and what is missing.
RecordedDrive read_drive(const std::string& bag);

/// The stamp of a message; zero for transforms and beacons, which are of no time.
ros::Time stamp_of(const DriveMessage& message);

}  // namespace pf_resampling
