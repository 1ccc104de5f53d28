#include "src/checkpoint/checkpoint.hpp"

namespace pf_resampling {
namespace {

// The checksum tells what is damaged.
template <typename Checkpoint>
void write(const std::string& path, const Checkpoint& checkpoint) {
  Archive archive(kCheckpointFile);
  describe(archive, const_cast<Checkpoint&>(checkpoint));  // only reads it
  write_bytes(kCheckpointFile, path, archive.bytes());
}

template <typename Checkpoint>
Checkpoint read(const std::string& path) {
  Archive archive(kCheckpointFile, path);
  Checkpoint checkpoint;
  describe(archive, checkpoint);
  return checkpoint;
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

void write_checkpoint(const std::string& path, const BeaconMclCheckpoint& checkpoint) {
  write(path, checkpoint);
}

void write_checkpoint(const std::string& path, const FastSlamCheckpoint& checkpoint) {
  write(path, checkpoint);
}

BeaconMclCheckpoint read_beacon_mcl_checkpoint(const std::string& path) {
  return read<BeaconMclCheckpoint>(path);
}

FastSlamCheckpoint read_fastslam_checkpoint(const std::string& path) {
  return read<FastSlamCheckpoint>(path);
}

}  // namespace pf_resampling
