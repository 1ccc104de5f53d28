#include "src/checkpoint/checkpoint.hpp"

namespace pf_resampling {
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
