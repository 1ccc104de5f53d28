#include "pf_resampling_core/filters/fastslam/smoothed_past.hpp"

#include <algorithm>
#include <cmath>

namespace pf_resampling {
namespace {

// Blocks that are left out at a time, a factorisation each; and that are kept of each kind.
constexpr std::size_t kMostBlocks = 8;
constexpr std::size_t kMostKept = 300;

// Seconds since the start.
std::vector<double> times_of(const SmoothedPastState& state) {
  std::vector<double> times(state.graph.poses.size(), state.time);
  for (std::size_t i = times.size() - 1; i > 0; --i) {
    times[i - 1] = times[i] - state.graph.motions[i - 1].duration();
  }
  return times;
}

// Evenly over all of them.
void keep_some(std::vector<LeftOutBlock>* blocks) {
  if (blocks->size() <= kMostBlocks) return;
  for (std::size_t i = 0; i < kMostBlocks; ++i) {
    (*blocks)[i] = (*blocks)[i * blocks->size() / kMostBlocks];
  }
  blocks->resize(kMostBlocks);
}

void add_newest(const std::vector<PredictedBlock>& blocks, std::vector<PredictedBlock>* all) {
  all->insert(all->end(), blocks.begin(), blocks.end());
  if (all->size() > kMostKept) {
    all->erase(all->begin(), all->end() - static_cast<std::ptrdiff_t>(kMostKept));
  }
}

}  // namespace

void SmoothedPast::clear() {
  *this = SmoothedPast();
}

void SmoothedPast::forget_drive() {
  SmoothedPastState left;
  left.graph.noise = state_.graph.noise;
  left.passages = std::move(state_.passages);
  left.windows = std::move(state_.windows);
  resume(left);
}

void SmoothedPast::start(const GaussianPrior& prior,
                         const std::vector<std::int64_t>& landmark_ids) {
  forget_drive();
  SmoothedPastState state = state_;
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
  state_.time += motion.duration();
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

void SmoothedPast::validate(double robust_width) {
  const std::vector<double> times = times_of(state_);
  SmoothingGraph& graph = state_.graph;
  std::vector<LeftOutBlock> of_passages = passages(graph, times, state_.validated, state_.time);
  std::vector<LeftOutBlock> of_windows = windows(graph, times, state_.validated, state_.time);
  state_.validated = state_.time;
  if (of_passages.empty() && of_windows.empty()) return;
  keep_some(&of_passages);
  keep_some(&of_windows);
  add_newest(cross_validate(graph, robust_width, of_passages), &state_.passages);
  add_newest(cross_validate(graph, robust_width, of_windows), &state_.windows);
  graph.noise = noise_scales(state_.passages, state_.windows);
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
