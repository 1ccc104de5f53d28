// How FastSlamPipeline is saved, and goes on from there.
#include "fastslam_node/fastslam_pipeline.hpp"
#include "pf_resampling_core/error.hpp"

namespace pf_resampling {

std::optional<FastSlamCheckpoint> FastSlamPipeline::checkpoint() {
  if (odometry_.empty()) return std::nullopt;
  FastSlamCheckpoint checkpoint;
  checkpoint.scene = scene_;
  checkpoint.filter = saved_map(&filter_, static_cast<int>(filter_.particles().size()));
  checkpoint.filter.frame = options_.frames.map;
  odometry_.save(&checkpoint.progress);
  checkpoint.progress.last_observation = static_cast<std::int64_t>(last_scan_.toNSec());
  checkpoint.progress.lost_probability = lost_.probability();
  checkpoint.progress.normalized_innovation = lost_.normalized_innovation();
  return checkpoint;
}

void FastSlamPipeline::resume(const FastSlamCheckpoint& checkpoint) {
  const std::string fault = fault_of(checkpoint.progress);
  if (!fault.empty()) throw Error("checkpoint: " + fault + "; start without it");
  filter_.load(checkpoint.filter);
  scene_ = checkpoint.scene;

  scans_.clear();
  latest_ = LatestScan{};
  sightings_.clear();
  path_stamps_.clear();
  reported_weight_resets_ = 0;
  odometry_.resume(checkpoint.progress, options_.filter.odometry);
  last_scan_.fromNSec(static_cast<std::uint64_t>(checkpoint.progress.last_observation));
  lost_.resume(checkpoint.progress.lost_probability, checkpoint.progress.normalized_innovation);
  belief_ = filter_.estimate();
}

}  // namespace pf_resampling
