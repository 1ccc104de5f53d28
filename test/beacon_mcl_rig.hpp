#pragma once

#include <vector>

#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"
#include "test/beacon_mcl_drive.hpp"
#include "test/pipeline_outputs.hpp"

namespace pf_resampling {

inline BeaconMclSinks sinks_into(Outputs* out) {
  BeaconMclSinks sinks;
  connect(out, &sinks);
  return sinks;
}

struct Rig {
  explicit Rig(const BeaconMclPipelineOptions& options = BeaconMclDrive::options())
      : pipeline(options, sinks_into(&out)) {}

  void feed(const std::vector<BeaconMclMessage>& messages) {
    for (const BeaconMclMessage& message : messages) handle(message, &pipeline);
  }

  double error() const {
    const auto& last = out.poses.back();
    const Pose2 truth = BeaconMclDrive::truth(last.header.stamp);
    return std::hypot(last.pose.pose.position.x - truth.x, last.pose.pose.position.y - truth.y);
  }

  Outputs out;
  BeaconMclPipeline pipeline;
};

inline bool same_particles(const BeaconMclParticles& a, const BeaconMclParticles& b) {
  return (a.x == b.x).all() && (a.y == b.y).all() && (a.heading == b.heading).all() &&
         (a.log_weight == b.log_weight).all() && (a.ancestor == b.ancestor).all() &&
         (a.yaw_rate_bias == b.yaw_rate_bias).all() && (a.scale == b.scale).all() &&
         (a.bias == b.bias).all();
}

}  // namespace pf_resampling
