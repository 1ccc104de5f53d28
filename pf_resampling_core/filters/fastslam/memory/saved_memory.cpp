#include "pf_resampling_core/filters/fastslam/memory/saved_memory.hpp"

#include <algorithm>
#include <cmath>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

bool is_landmark(int number, std::size_t landmarks) {
  return number >= 0 && static_cast<std::size_t>(number) < landmarks;
}

// Of one without data.
std::string fault_of_given(const Segment& segment) {
  const Eigen::MatrixXd& information = segment.condensed->information[DataKind::given];
  const auto is_of_tracks = [&](const std::array<int, 2>& pair) {
    return is_landmark(pair[0], segment.tracks.size()) &&
           is_landmark(pair[1], segment.tracks.size());
  };
  const bool fits = segment.sightings.empty() && information.rows() == segment.size() &&
                    information.cols() == segment.size() &&
                    segment.condensed->gradient[DataKind::given].size() == segment.size() &&
                    segment.tracks.size() == segment.landmarks.size() &&
                    std::all_of(segment.beside.begin(), segment.beside.end(), is_of_tracks);
  return fits ? "" : "its belief has not the size of its landmarks";
}

// Of one that was condensed, or has still to be.
std::string fault_of_data(const Segment& segment, bool is_condensed) {
  SmoothingGraph data;
  data.poses.resize(segment.motions.size() + 1);
  data.landmarks.assign(std::max<std::size_t>(1, segment.landmarks.size()),
                        Eigen::Vector2d::Zero());
  data.constants = segment.constants;
  data.motions = segment.motions;
  data.sightings = segment.sightings;
  data.sightings.insert(data.sightings.end(), segment.unassigned.begin(), segment.unassigned.end());
  for (SightingFactor& sighting : data.sightings) {  // of none: as good as of one of them
    if (sighting.landmark < 0) sighting.landmark = 0;
  }
  const auto is_of_track = [&](const SightingFactor& sighting) {
    return is_landmark(sighting.landmark, segment.landmarks.size());
  };
  const bool has_tracks =
      std::all_of(segment.sightings.begin(), segment.sightings.end(), is_of_track);
  const bool has_poses = is_condensed ? segment.poses.size() == segment.motions.size() &&
                                            segment.tracks.size() == segment.landmarks.size()
                                      : segment.poses.empty() && segment.tracks.empty();
  const auto is_of_motion = [&](const SightingFactor& sighting) {
    return sighting.pose >= 0 && static_cast<std::size_t>(sighting.pose) < segment.motions.size();
  };
  if (!has_poses || !has_tracks ||
      !std::all_of(data.sightings.begin(), data.sightings.end(), is_of_motion)) {
    return "needs a pose for every motion, a track for every landmark, and sightings from its own "
           "poses";
  }
  try {
    check(data);
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

bool is_scale(double scale) {
  return scale >= kSmallestNoiseScale && scale <= kLargestNoiseScale;
}

}  // namespace

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
  if (!archive.is_reading()) return;
  const bool is_condensed = !segment.poses.empty();
  const std::string fault =
      is_given ? fault_of_given(segment) : fault_of_data(segment, is_condensed);
  if (!fault.empty()) archive.refuse(fault);
  if (is_given || !is_condensed) return;
  if (!(segment.motion_share > 0.0) || !condense(segment.robust_width, &segment)) {
    archive.refuse("its data do not determine it");
  }
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

std::string fault_of(const MemoryState& memory) {
  const SegmentGraph& graph = memory.graph;
  if (graph.bases.empty()) return {};
  const std::size_t segments = graph.segments.size();
  const std::size_t landmarks = memory.landmarks.size();
  const bool fits = graph.bases.size() == segments + 1 && graph.motion_shares.size() == segments &&
                    memory.begins.size() == segments && graph.landmarks.size() <= landmarks;
  if (!fits) {
    return "the memory is inconsistent: every segment needs a base, and every landmark an id";
  }
  const auto is_known = [&](const Segment& segment, std::size_t among) {
    return std::all_of(segment.landmarks.begin(), segment.landmarks.end(),
                       [&](int landmark) { return is_landmark(landmark, among); });
  };
  const auto is_segment = [&](const std::shared_ptr<const Segment>& segment) {
    return !segment->poses.empty() && is_known(*segment, graph.landmarks.size());
  };
  const bool are_known = std::all_of(graph.segments.begin(), graph.segments.end(), is_segment) &&
                         is_known(memory.open, landmarks) && memory.open.poses.empty();
  // Landmarks that have no place yet get theirs in the order in which the open segment saw them.
  std::size_t placed = graph.landmarks.size();
  for (const int landmark : memory.open.landmarks) {
    if (landmark >= 0 && static_cast<std::size_t>(landmark) == placed) ++placed;
  }
  if (!are_known || placed != landmarks) {
    return "the memory is inconsistent: it speaks of a landmark that is not there";
  }
  const auto is_share = [](double share) { return share > 0.0 && share <= 1.0; };
  if (!is_scale(graph.noise.range) || !is_scale(graph.noise.bearing) ||
      !is_scale(graph.noise.motion) || !are_plausible(graph.constants) ||
      !std::all_of(graph.motion_shares.begin(), graph.motion_shares.end(), is_share)) {
    return "the memory has a scale of noise, a weight of odometry or a constant of the sensors "
           "that is out of range";
  }
  return {};
}

}  // namespace pf_resampling
