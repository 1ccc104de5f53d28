#include "pf_resampling_core/filters/fastslam/memory/saved_memory.hpp"

namespace pf_resampling {
void describe(Archive& archive, Segment& segment) {
  PF_RESAMPLING_FIELDS(archive, segment.motions, segment.sightings, segment.unassigned,
                       segment.landmarks, segment.poses, segment.tracks, segment.constants,
                       segment.noise, segment.motion_share, segment.robust_width);
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
  PF_RESAMPLING_FIELDS(archive, landmark.id, landmark.last_seen, landmark.fitted, landmark.doubted,
                       landmark.is_dormant);
  archive.if_there("twice", landmark.twice);
}

void describe(Archive& archive, SegmentGraph& graph) {
  PF_RESAMPLING_FIELDS(archive, graph.segments, graph.bases, graph.landmarks, graph.constants,
                       graph.constants_mean, graph.constants_sigma, graph.noise,
                       graph.motion_shares);
}

void describe(Archive& archive, MemoryState& memory) {
  if (!archive.something(!memory.graph.bases.empty())) return;
  PF_RESAMPLING_FIELDS(archive, memory.graph, memory.landmarks, memory.begins, memory.open,
                       memory.open_doubts, memory.newest, memory.is_refused, memory.distrusted,
                       memory.next_start, memory.next_scale_check, memory.scale_is_wrong,
                       memory.updates, memory.decided, memory.longest_absence, memory.time,
                       memory.closed, memory.validated, memory.passages, memory.windows);
  archive.if_there("distance", memory.distance);
  archive.if_there("speed", memory.speed);
  archive.if_there("windows_validated", memory.windows_validated);
}

}  // namespace pf_resampling
