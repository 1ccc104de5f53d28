#include "pf_resampling_core/filters/fastslam/memory/saved_memory.hpp"

namespace pf_resampling {
void describe(Archive& archive, Segment& segment) {
  archive("motions", segment.motions);
  archive("sightings", segment.sightings);
  archive("unassigned", segment.unassigned);
  archive("landmarks", segment.landmarks);
  archive("poses", segment.poses);
  archive("tracks", segment.tracks);
  archive("constants", segment.constants);
  archive("noise", segment.noise);
  archive("motion_share", segment.motion_share);
  archive("robust_width", segment.robust_width);
  const bool is_given = !segment.has_data() && !segment.poses.empty();
  if (is_given) {
    CondensedSegment given;
    if (segment.condensed != nullptr) given = *segment.condensed;
    archive("information", given.information[DataKind::given]);
    archive("gradient", given.gradient[DataKind::given]);
    archive("beside", segment.beside);
    if (archive.is_reading()) {
      segment.condensed =
          condensed_belief(given.information[DataKind::given], given.gradient[DataKind::given]);
    }
  }
  if (!archive.is_reading() || is_given || segment.poses.empty()) return;
  if (!condense(segment.robust_width, &segment)) archive.refuse("its data do not determine it");
}

void describe(Archive& archive, RememberedLandmark& landmark) {
  archive("id", landmark.id);
  archive("last_seen", landmark.last_seen);
  archive("fitted", landmark.fitted);
  archive("doubted", landmark.doubted);
  archive("is_dormant", landmark.is_dormant);
}

void describe(Archive& archive, SegmentGraph& graph) {
  archive("segments", graph.segments);
  archive("bases", graph.bases);
  archive("landmarks", graph.landmarks);
  archive("constants", graph.constants);
  archive("constants_mean", graph.constants_mean);
  archive("constants_sigma", graph.constants_sigma);
  archive("noise", graph.noise);
  archive("motion_shares", graph.motion_shares);
}

void describe(Archive& archive, MemoryState& memory) {
  if (!archive.something(!memory.graph.bases.empty())) return;
  archive("graph", memory.graph);
  archive("landmarks", memory.landmarks);
  archive("begins", memory.begins);
  archive("open", memory.open);
  archive("open_doubts", memory.open_doubts);
  archive("newest", memory.newest);
  archive("is_refused", memory.is_refused);
  archive("distrusted", memory.distrusted);
  archive("next_start", memory.next_start);
  archive("next_scale_check", memory.next_scale_check);
  archive("scale_is_wrong", memory.scale_is_wrong);
  archive("updates", memory.updates);
  archive("decided", memory.decided);
  archive("longest_absence", memory.longest_absence);
  archive("time", memory.time);
  archive("closed", memory.closed);
  archive("validated", memory.validated);
  archive("next_validation", memory.next_validation);
  archive("passages", memory.passages);
  archive("windows", memory.windows);
}

}  // namespace pf_resampling
