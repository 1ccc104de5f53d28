#include "pf_resampling_core/filters/fastslam/smoothed_past.hpp"

#include <algorithm>
#include <cmath>

namespace pf_resampling {

void SmoothedPast::clear() {
  *this = SmoothedPast();
}

void SmoothedPast::start(const GaussianPrior& prior,
                         const std::vector<std::int64_t>& landmark_ids) {
  SmoothedPastState state;
  state.graph.prior = prior;
  state.graph.poses = {prior.pose};
  state.graph.landmarks = prior.landmarks;
  state.graph.constants = prior.constants;
  state.landmark_ids = landmark_ids;
  state.last_seen.assign(landmark_ids.size(), 0);
  resume(state);
}

void SmoothedPast::resume(const SmoothedPastState& state) {
  state_ = state;
  numbers_.clear();
  for (std::size_t l = 0; l < state.landmark_ids.size(); ++l) {
    if (state.landmark_ids[l] >= 0) numbers_[state.landmark_ids[l]] = static_cast<int>(l);
  }
}

void SmoothedPast::append(const MotionFactor& motion) {
  SmoothingGraph& graph = state_.graph;
  graph.poses.push_back(compose(graph.poses.back(), corrected_motion(motion, graph.constants)));
  graph.motions.push_back(motion);
  state_.longest_absence = 0;
}

void SmoothedPast::append_sighting(std::int64_t landmark_id, bool is_new, SightingFactor sighting) {
  SmoothingGraph& graph = state_.graph;
  const int pose = static_cast<int>(graph.poses.size()) - 1;
  if (is_new) forget_landmark(landmark_id);
  int number = number_of(landmark_id);
  if (number < 0) {
    number = static_cast<int>(graph.landmarks.size());
    numbers_[landmark_id] = number;
    const Pose2 eye = compose(graph.poses.back(), sighting.sensor);
    const double direction = eye.heading + sighting.bearing;
    graph.landmarks.emplace_back(eye.x + sighting.range * std::cos(direction),
                                 eye.y + sighting.range * std::sin(direction));
    state_.landmark_ids.push_back(landmark_id);
    state_.last_seen.push_back(pose);
  }
  sighting.pose = pose;
  sighting.landmark = number;
  graph.sightings.push_back(sighting);
  int& last = state_.last_seen[static_cast<std::size_t>(number)];
  state_.longest_absence = std::max(state_.longest_absence, pose - last - 1);
  last = pose;
}

void SmoothedPast::forget_landmark(std::int64_t id) {
  const int number = number_of(id);
  if (number < 0) return;
  numbers_.erase(id);
  state_.landmark_ids[static_cast<std::size_t>(number)] = -1;
  std::vector<SightingFactor>& sightings = state_.graph.sightings;
  sightings.erase(
      std::remove_if(sightings.begin(), sightings.end(),
                     [&](const SightingFactor& sighting) { return sighting.landmark == number; }),
      sightings.end());
}

void SmoothedPast::bound(int window, double robust_width) {
  const int surplus = static_cast<int>(state_.graph.poses.size()) - window;
  if (2 * surplus <= window) return;
  if (!forget_oldest(surplus, robust_width, &state_.graph)) return;
  for (int& last : state_.last_seen) last -= surplus;
}

int SmoothedPast::number_of(std::int64_t landmark_id) const {
  const auto found = numbers_.find(landmark_id);
  return found == numbers_.end() ? -1 : found->second;
}

}  // namespace pf_resampling
