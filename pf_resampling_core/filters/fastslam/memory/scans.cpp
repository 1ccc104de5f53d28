#include "pf_resampling_core/filters/fastslam/memory/scans.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "pf_resampling_core/filters/fastslam/memory/segment_solver.hpp"
#include "pf_resampling_core/filters/fastslam/memory/sensor_view.hpp"

namespace pf_resampling {
namespace {

// A passage lasts so many scans at least, with no longer gaps, s.
constexpr int kFewestLooks = 2;
constexpr double kPassageEnd = 5.0;

// Puts the sightings of a segment to the landmarks that `landmark_of` says, in order; tracks to
// where the graph has these.
void assign(const std::vector<SightingFactor>& sightings, const Pose2& base,
            const SegmentGraph& graph, Segment* segment) {
  segment->sightings.clear();
  segment->unassigned.clear();
  segment->landmarks.clear();
  segment->tracks.clear();
  for (const SightingFactor& sighting : sightings) {
    if (sighting.landmark < 0) {
      segment->unassigned.push_back(sighting);
    } else {
      add_sighting(sighting.landmark, sighting, segment);
    }
  }
  for (const int landmark : segment->landmarks) {
    segment->tracks.push_back(seen_from(base, graph.landmarks[static_cast<std::size_t>(landmark)]));
  }
}

// All sightings of a segment with landmarks of the graph, those of no landmark behind the others of
// their scan.
std::vector<SightingFactor> sightings_of(const Segment& segment) {
  std::vector<SightingFactor> sightings = segment.sightings;
  for (SightingFactor& sighting : sightings) {
    sighting.landmark = segment.landmarks[static_cast<std::size_t>(sighting.landmark)];
  }
  if (segment.unassigned.empty()) return sightings;
  sightings.insert(sightings.end(), segment.unassigned.begin(), segment.unassigned.end());
  std::stable_sort(
      sightings.begin(), sightings.end(),
      [](const SightingFactor& a, const SightingFactor& b) { return a.pose < b.pose; });
  return sightings;
}

bool fit_and_condense(double robust_width, Segment* segment) {
  return fit(FreePart::between, robust_width, segment) && condense(robust_width, segment);
}

}  // namespace

std::size_t first_of_newest(const SegmentGraph& graph, int updates) {
  std::size_t from = graph.segments.size();
  int count = 0;
  while (from > 0 && count < updates && graph.segments[from - 1]->has_data()) {
    count += static_cast<int>(graph.segments[--from]->motions.size());
  }
  return from;
}

Scans newest_scans(const SegmentGraph& graph, const std::vector<double>& begins, int updates) {
  Scans scans;
  const std::size_t from = first_of_newest(graph, updates);
  scans.first_segment = from;
  for (std::size_t s = 0; s < from; ++s) {
    scans.first_update += static_cast<int>(graph.segments[s]->updates());
  }
  for (std::size_t s = from; s < graph.segments.size(); ++s) {
    const Segment segment = at_estimate(graph, s);
    const int first = static_cast<int>(scans.poses.size());
    for (const Pose2& pose : segment.poses) scans.poses.push_back(compose(graph.bases[s], pose));
    const std::vector<double> times = times_of(segment, begins[s]);
    scans.times.insert(scans.times.end(), times.begin(), times.end());
    scans.motions.insert(scans.motions.end(), segment.motions.begin(), segment.motions.end());
    for (SightingFactor sighting : sightings_of(segment)) {
      sighting.pose += first;
      scans.before.push_back(sighting.landmark);
      scans.sightings.push_back(sighting);
    }
    scans.ends.push_back(scans.poses.size());
  }
  return scans;
}

bool put_back(const Scans& scans, double robust_width, SegmentGraph* graph) {
  std::size_t next = 0;
  std::size_t begin = 0;
  for (std::size_t s = scans.first_segment; s < graph->segments.size(); ++s) {
    const std::size_t end = scans.ends[s - scans.first_segment];
    const std::size_t first = next;
    bool has_changed = false;
    for (; next < scans.sightings.size() &&
           static_cast<std::size_t>(scans.sightings[next].pose) < end;
         ++next) {
      has_changed = has_changed || scans.sightings[next].landmark != scans.before[next];
    }
    graph->bases[s + 1] = scans.poses[end - 1];
    if (has_changed) {
      Segment segment = at_estimate(*graph, s);
      const Pose2& base = graph->bases[s];
      for (std::size_t i = begin; i < end; ++i) {
        segment.poses[i - begin] = relative(base, scans.poses[i]);
      }
      std::vector<SightingFactor> sightings(
          scans.sightings.begin() + static_cast<std::ptrdiff_t>(first),
          scans.sightings.begin() + static_cast<std::ptrdiff_t>(next));
      for (SightingFactor& sighting : sightings) sighting.pose -= static_cast<int>(begin);
      assign(sightings, base, *graph, &segment);
      if (!fit_and_condense(robust_width, &segment)) return false;
      graph->segments[s] = std::make_shared<const Segment>(std::move(segment));
    }
    begin = end;
  }
  return true;
}

std::vector<double> times_of(const Segment& segment, double begin) {
  std::vector<double> times;
  for (const MotionFactor& motion : segment.motions) times.push_back(begin += motion.duration());
  return times;
}

void for_each_sighting(const SegmentGraph& graph, const std::vector<double>& begins,
                       const std::function<void(int, double, const SightingFactor&, int)>& visit) {
  int update = 0;
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    const Segment& segment = *graph.segments[s];
    const std::vector<double> times = times_of(segment, begins[s]);
    for (const SightingFactor& sighting : segment.sightings) {
      visit(update + sighting.pose, times[static_cast<std::size_t>(sighting.pose)], sighting,
            segment.landmarks[static_cast<std::size_t>(sighting.landmark)]);
    }
    update += static_cast<int>(segment.updates());
  }
}

std::vector<bool> seen_landmarks(const SegmentGraph& graph, std::size_t from) {
  std::vector<bool> are_seen(graph.landmarks.size(), false);
  for (std::size_t s = from; s < graph.segments.size(); ++s) {
    for (const int landmark : graph.segments[s]->landmarks) {
      are_seen[static_cast<std::size_t>(landmark)] = true;
    }
  }
  return are_seen;
}

Together seen_together(const SegmentGraph& graph, const std::vector<int>& landmarks) {
  const Eigen::Index count = static_cast<Eigen::Index>(landmarks.size());
  Together together = Together::Constant(count, count, false);
  std::vector<int> index_of(graph.landmarks.size(), -1);
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    index_of[static_cast<std::size_t>(landmarks[i])] = static_cast<int>(i);
  }
  for (const auto& segment : graph.segments) {
    const auto index_of_track = [&](int track) {
      const int landmark = segment->landmarks[static_cast<std::size_t>(track)];
      return index_of[static_cast<std::size_t>(landmark)];
    };
    const auto note = [&](int i, int j) {
      if (i >= 0 && j >= 0) together(i, j) = together(j, i) = true;
    };
    for (const auto& [a, b] : segment->beside) note(index_of_track(a), index_of_track(b));
    const std::vector<SightingFactor>& seen = segment->sightings;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      for (std::size_t j = i + 1; j < seen.size() && seen[j].pose == seen[i].pose; ++j) {
        note(index_of_track(seen[i].landmark), index_of_track(seen[j].landmark));
      }
    }
  }
  return together;
}

ViewPassages view_passages(const std::vector<Eigen::Vector2d>& places,
                           const std::vector<const Scans*>& parts) {
  SensorView view;
  for (const Scans* scans : parts) {
    for (const SightingFactor& sighting : scans->sightings) {
      view.add(sighting.range, sighting.bearing);
    }
  }
  struct Passage {
    int looks = 0;
    int sightings = 0;
    double last = 0.0;  // s
  };
  ViewPassages passages;
  std::vector<Passage> open(places.size());
  const auto close = [&](Passage* passage) {
    if (passage->looks >= kFewestLooks) {
      ++passages.all;
      if (passage->sightings == 0) {
        ++passages.missed;
      } else if (2 * passage->sightings < passage->looks) {
        ++passages.hardly_seen;
      }
    }
    *passage = {};
  };
  const auto passage_at = [&](std::size_t l, double now) -> Passage& {
    if (open[l].looks > 0 && now - open[l].last > kPassageEnd) close(&open[l]);
    open[l].last = now;
    return open[l];
  };
  const double reach = view.reach();
  const auto look = [&](const Pose2& eye, double now) {
    const Eigen::Vector2d at(eye.x, eye.y);
    const Eigen::Matrix2d to_eye = Eigen::Rotation2Dd(-eye.heading).toRotationMatrix();
    for (std::size_t l = 0; l < places.size(); ++l) {
      const Eigen::Vector2d offset = places[l] - at;
      if (offset.squaredNorm() < reach * reach && view.covers(to_eye * offset)) {
        ++passage_at(l, now).looks;
      }
    }
  };
  for (const Scans* scans : parts) {
    int pose = -1;
    for (const SightingFactor& sighting : scans->sightings) {
      const std::size_t i = static_cast<std::size_t>(sighting.pose);
      if (sighting.pose != pose) look(compose(scans->poses[i], sighting.sensor), scans->times[i]);
      pose = sighting.pose;
      if (sighting.landmark < 0) continue;
      ++passage_at(static_cast<std::size_t>(sighting.landmark), scans->times[i]).sightings;
    }
  }
  for (Passage& passage : open) close(&passage);
  return passages;
}

bool renumber(const std::vector<int>& new_number, double robust_width, SegmentGraph* graph) {
  for (std::size_t s = 0; s < graph->segments.size(); ++s) {
    std::vector<int> landmarks = graph->segments[s]->landmarks;
    for (int& landmark : landmarks) landmark = new_number[static_cast<std::size_t>(landmark)];
    if (landmarks == graph->segments[s]->landmarks) continue;
    if (std::find(landmarks.begin(), landmarks.end(), -1) == landmarks.end()) {
      Segment segment = *graph->segments[s];
      segment.landmarks = std::move(landmarks);
      graph->segments[s] = std::make_shared<const Segment>(std::move(segment));
      continue;
    }
    Segment segment = at_estimate(*graph, s);
    std::vector<SightingFactor> sightings = sightings_of(segment);
    for (SightingFactor& sighting : sightings) {
      if (sighting.landmark < 0) continue;
      sighting.landmark = new_number[static_cast<std::size_t>(sighting.landmark)];
    }
    assign(sightings, graph->bases[s], *graph, &segment);
    if (!fit_and_condense(robust_width, &segment)) return false;
    graph->segments[s] = std::make_shared<const Segment>(std::move(segment));
  }
  return true;
}

}  // namespace pf_resampling
