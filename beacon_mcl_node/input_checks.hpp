#pragma once

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>
#include <pf_resampling/BeaconArray.h>
#include <pf_resampling/BeaconRange.h>

#include <optional>
#include <string>
#include <vector>

#include "beacon_mcl_node/pipeline_options.hpp"
#include "pf_resampling/odometry_buffer.hpp"
#include "pf_resampling/rejects.hpp"

namespace pf_resampling {

/// Why a message cannot be used, with the values, and the remedy where there is one.
struct Rejection {
  RejectReason reason;
  std::string detail;
};

/// What can be told of a message by itself. Nothing: it can be used.
std::optional<Rejection> check(const nav_msgs::Odometry& odometry,
                               const BeaconMclPipelineOptions& options);
std::optional<Rejection> check(const BeaconRange& range);
std::optional<Rejection> check(const BeaconArray& beacons, const BeaconMclPipelineOptions& options);
std::optional<Rejection> check(const geometry_msgs::PoseWithCovarianceStamped& pose,
                               const BeaconMclPipelineOptions& options);

/// A checked odometry message for the buffer; with its covariance if that is one of planar motion.
StampedOdometry to_stamped_odometry(const nav_msgs::Odometry& odometry);

/// A checked array. A height of NaN means that the beacon is as high as the antenna.
std::vector<Beacon> to_beacons(const BeaconArray& beacons);

}  // namespace pf_resampling
