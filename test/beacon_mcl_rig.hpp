#pragma once

#include <vector>

#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"
#include "test/beacon_mcl_drive.hpp"
#include "test/pipeline_rig.hpp"

namespace pf_resampling {

struct BeaconMclOutputs : Outputs {
  std::vector<BeaconMap> maps;
};

inline BeaconMclSinks sinks_into(BeaconMclOutputs* out) {
  BeaconMclSinks sinks;
  connect(out, &sinks);
  sinks.beacon_map = [out](const BeaconMap& map) { out->maps.push_back(map); };
  return sinks;
}

struct Rig : PipelineRig<BeaconMclPipeline, BeaconMclDrive, BeaconMclOutputs, BeaconMclMessage> {
  using PipelineRig::PipelineRig;
  static constexpr const char* kTopic = "ranges";
  const BeaconMclParticles& particles() const { return pipeline.filter()->particles(); }
};

inline bool same_particles(const BeaconMclParticles& a, const BeaconMclParticles& b) {
  return a.size() == b.size() && (a.x == b.x).all() && (a.y == b.y).all() &&
         (a.heading == b.heading).all() && (a.log_weight == b.log_weight).all() &&
         (a.ancestor == b.ancestor).all() && (a.yaw_rate_bias == b.yaw_rate_bias).all() &&
         (a.scale == b.scale).all() && (a.bias == b.bias).all();
}

}  // namespace pf_resampling
