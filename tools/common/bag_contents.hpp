#pragma once

#include <rosbag/bag.h>

#include <Eigen/Geometry>
#include <map>
#include <string>
#include <vector>

#include "pf_resampling_core/evaluation/stamped_path.hpp"
#include "pf_resampling_core/models/beacon_range.hpp"

namespace pf_resampling {

/// What a bag says about places, as plain values. Stamps are those of the headers (of the bag where
/// a header has none); all lists are in order of their stamps. The topic's presence is the caller's
/// to check (require_topics); a message that cannot be used is an Error that names topic and time.

/// Message types that read_truth() takes.
std::vector<std::string> truth_types();
/// Message types that read_poses() takes.
std::vector<std::string> pose_types();

/// True poses. PointStamped has no heading; nor has a PoseStamped with the quaternion 0, 0, 0, 0.
std::vector<TruePose> read_truth(const rosbag::Bag& bag, const std::string& topic);

/// Poses with covariance, or without (zero).
std::vector<EstimatedPose> read_poses(const rosbag::Bag& bag, const std::string& topic);

/// The true poses while there is odometry (all if that is empty): a reference that was switched on
/// earlier, or off later, is nothing a filter can be judged by. Throws Error if that leaves none.
std::vector<TruePose> truth_while_recording(const std::vector<TruePose>& truth,
                                            const std::vector<EstimatedPose>& odometry);

/// The beacons of the last message on a topic of BeaconArray; none if there is none. A height
/// of NaN says that the beacon is as high as the antenna.
std::vector<Beacon> read_beacons(const rosbag::Bag& bag, const std::string& topic);

/// A range with its time and the frame of the antenna.
struct StampedRange {
  double time = 0.0;  ///< s
  std::string frame;
  int beacon = 0;
  double range = 0.0;  ///< m
};
std::vector<StampedRange> read_ranges(const rosbag::Bag& bag, const std::string& topic);

/// Where the frames of /tf_static sit on the robot: transforms from `base`, chained, by frame.
std::map<std::string, Eigen::Isometry3d> read_frames_on_robot(const rosbag::Bag& bag,
                                                              const std::string& base);

}  // namespace pf_resampling
