#include "src/checkpoint/checkpoint.hpp"

namespace pf_resampling {
namespace {

std::string fault_of_scene(const Eigen::AlignedBox2d& scene) {
  if (!scene.min().allFinite() || !scene.max().allFinite()) return "the scene is not finite";
  if (!((scene.min().array().abs() <= kFarthestPosition).all() &&
        (scene.max().array().abs() <= kFarthestPosition).all())) {
    return "the scene is beyond 1e9 m";
  }
  if (scene.isEmpty()) return "the scene is empty";
  return {};
}

}  // namespace

void describe(Archive& archive, BeaconMclCheckpoint& checkpoint) {
  archive.constant("filter", "beacon_mcl");
  archive("progress", checkpoint.progress);
  archive("state", checkpoint.filter);
}

void describe(Archive& archive, FastSlamCheckpoint& checkpoint) {
  archive.constant("filter", "fastslam");
  archive("progress", checkpoint.progress);
  archive("scene_min", checkpoint.scene.min());
  archive("scene_max", checkpoint.scene.max());
  archive("state", checkpoint.filter);
}

std::string fault_of(const BeaconMclCheckpoint& checkpoint) {
  const std::string fault = fault_of(checkpoint.progress);
  return fault.empty() ? fault_of(checkpoint.filter) : fault;
}

std::string fault_of(const FastSlamCheckpoint& checkpoint) {
  std::string fault = fault_of(checkpoint.progress);
  if (fault.empty()) fault = fault_of_scene(checkpoint.scene);
  return fault.empty() ? fault_of(checkpoint.filter) : fault;
}

void write_checkpoint(const std::string& path, const BeaconMclCheckpoint& checkpoint) {
  write_saved(kCheckpointFile, path, checkpoint);
}

void write_checkpoint(const std::string& path, const FastSlamCheckpoint& checkpoint) {
  write_saved(kCheckpointFile, path, checkpoint);
}

BeaconMclCheckpoint read_beacon_mcl_checkpoint(const std::string& path) {
  return read_saved<BeaconMclCheckpoint>(kCheckpointFile, path);
}

FastSlamCheckpoint read_fastslam_checkpoint(const std::string& path) {
  return read_saved<FastSlamCheckpoint>(kCheckpointFile, path);
}

}  // namespace pf_resampling
