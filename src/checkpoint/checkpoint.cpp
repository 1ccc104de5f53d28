#include "src/checkpoint/checkpoint.hpp"

namespace pf_resampling {
void describe(Archive& archive, BeaconMclCheckpoint& checkpoint) {
  archive.constant("filter", "beacon_mcl");
  archive("progress", checkpoint.progress);
  archive.if_there("found", checkpoint.found);
  archive.if_there("found_since", checkpoint.found_since);
  if (checkpoint.found.size() != checkpoint.found_since.size()) {
    archive.refuse("found and found_since are not equally long");
  }
  archive("state", checkpoint.filter);
}

void describe(Archive& archive, FastSlamCheckpoint& checkpoint) {
  archive.constant("filter", "fastslam");
  archive("progress", checkpoint.progress);
  archive("scene_min", checkpoint.scene.min());
  archive("scene_max", checkpoint.scene.max());
  archive("state", checkpoint.filter);
}

}  // namespace pf_resampling
