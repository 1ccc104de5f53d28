#pragma once

#include <ros/time.h>

#include <vector>

#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"

namespace pf_resampling {

struct StampedEstimate {
  ros::Time stamp;
  PoseEstimate estimate;
};

/// What a run gave, apart from messages.
struct BeaconMclRun {
  std::vector<StampedEstimate> estimates;  ///< at odometry rate
  BeaconMclStatus status;                  ///< at the end
  std::vector<CalibrationEstimate> calibration;
  ScalarEstimate yaw_rate_bias;
  RejectCounter rejects;
};

/// Runs the filter over messages in memory, in their order; for studies with many seeds and
/// configurations on one recording. Throws Error on options that make no sense.
BeaconMclRun run_over_messages(const std::vector<BeaconMclMessage>& messages,
                               const BeaconMclPipelineOptions& options);

}  // namespace pf_resampling
