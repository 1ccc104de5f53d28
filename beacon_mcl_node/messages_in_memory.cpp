#include "beacon_mcl_node/messages_in_memory.hpp"

namespace pf_resampling {

BeaconMclRun run_over_messages(const std::vector<BeaconMclMessage>& messages,
                               const BeaconMclPipelineOptions& options) {
  BeaconMclRun run;
  run.estimates.reserve(messages.size());
  BeaconMclSinks sinks;
  sinks.estimate = [&run](ros::Time stamp, const PoseEstimate& estimate) {
    run.estimates.push_back({stamp, estimate});
  };
  BeaconMclPipeline pipeline(options, sinks);
  for (const BeaconMclMessage& message : messages) handle(message, &pipeline);
  run.rejects = pipeline.rejects();
  if (pipeline.filter() != nullptr) {
    run.status = pipeline.filter()->status();
    run.calibration = pipeline.filter()->calibration();
    run.yaw_rate_bias = pipeline.filter()->yaw_rate_bias();
  }
  return run;
}

}  // namespace pf_resampling
