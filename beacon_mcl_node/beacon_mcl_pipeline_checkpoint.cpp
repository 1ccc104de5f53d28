// How BeaconMclPipeline is saved, and goes on from there.
#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"
#include "pf_resampling_core/error.hpp"

namespace pf_resampling {

std::optional<BeaconMclCheckpoint> BeaconMclPipeline::checkpoint() const {
  if (!filter_ || !filter_->is_initialized() || odometry_.empty()) return std::nullopt;
  BeaconMclCheckpoint checkpoint;
  checkpoint.filter = filter_->saved();
  odometry_.save(&checkpoint.progress);
  checkpoint.progress.last_observation = static_cast<std::int64_t>(last_range_.toNSec());
  checkpoint.progress.lost_probability = lost_.probability();
  checkpoint.progress.normalized_innovation = lost_.normalized_innovation();
  return checkpoint;
}

void BeaconMclPipeline::resume(const BeaconMclCheckpoint& checkpoint) {
  const std::string fault = fault_of(checkpoint.progress);
  if (!fault.empty()) throw Error("checkpoint: " + fault + "; start without it");
  const std::vector<Beacon>& beacons =
      options_.beacons.empty() ? checkpoint.filter.beacons : options_.beacons;
  std::unique_ptr<BeaconMcl> filter = make_filter(beacons);
  filter->load(checkpoint.filter);

  filter_ = std::move(filter);
  pending_start_.reset();
  ranges_.clear();
  latest_ranges_.clear();
  beacon_health_.clear();
  publisher_.clear_path();
  reported_weight_resets_ = 0;
  odometry_.resume(checkpoint.progress, options_.filter.odometry);
  last_range_.fromNSec(static_cast<std::uint64_t>(checkpoint.progress.last_observation));
  lost_.resume(checkpoint.progress.lost_probability, checkpoint.progress.normalized_innovation);
  take_belief();
}

}  // namespace pf_resampling
