#include "pf_resampling_core/filters/fastslam/smoothed_past.hpp"

#include <algorithm>
#include <cmath>

namespace pf_resampling {

void SmoothedPast::clear() {
  *this = SmoothedPast();
}

void SmoothedPast::start(const GaussianPrior& prior,
                         const std::vector<std::int64_t>& landmark_ids) {
  clear();
  graph_.prior = prior;
  graph_.poses = {prior.pose};
  graph_.landmarks = prior.landmarks;
  graph_.constants = prior.constants;
  for (const std::int64_t id : landmark_ids) {
    numbers_.emplace(id, static_cast<int>(numbers_.size()));
    last_seen_.push_back(0);
  }
}

void SmoothedPast::append(const MotionFactor& motion) {
  graph_.poses.push_back(
      compose(graph_.poses.back(), corrected_motion(motion, graph_.constants)));
  graph_.motions.push_back(motion);
  longest_absence_ = 0;
}

void SmoothedPast::append_sighting(std::int64_t landmark_id, bool is_new,
                                   SightingFactor sighting) {
  const int pose = static_cast<int>(graph_.poses.size()) - 1;
  int number = number_of(landmark_id);
  if (number >= 0 && is_new) forget_landmark(landmark_id);
  if (number < 0 || is_new) {
    number = static_cast<int>(graph_.landmarks.size());
    numbers_[landmark_id] = number;
    const Pose2 eye = compose(graph_.poses.back(), sighting.sensor);
    const double direction = eye.heading + sighting.bearing;
    graph_.landmarks.emplace_back(eye.x + sighting.range * std::cos(direction),
                                  eye.y + sighting.range * std::sin(direction));
    last_seen_.push_back(pose);
  }
  sighting.pose = pose;
  sighting.landmark = number;
  graph_.sightings.push_back(sighting);
  int& last = last_seen_[static_cast<std::size_t>(number)];
  longest_absence_ = std::max(longest_absence_, pose - last - 1);
  last = pose;
}

void SmoothedPast::forget_landmark(std::int64_t id) {
  const int number = number_of(id);
  if (number < 0) return;
  numbers_.erase(id);
  std::vector<SightingFactor>& sightings = graph_.sightings;
  sightings.erase(
      std::remove_if(sightings.begin(), sightings.end(),
                     [&](const SightingFactor& sighting) { return sighting.landmark == number; }),
      sightings.end());
}

bool SmoothedPast::closes_loop(int absence) const {
  return longest_absence_ >= absence;
}

SmoothingResult SmoothedPast::solve(const SmoothingOptions& options) {
  return smooth(options, &graph_);
}

void SmoothedPast::bound(int window, double robust_width) {
  const int surplus = static_cast<int>(graph_.poses.size()) - window;
  if (2 * surplus <= window) return;
  forget_oldest(surplus, robust_width, &graph_);
  for (int& last : last_seen_) last -= surplus;
}

int SmoothedPast::number_of(std::int64_t landmark_id) const {
  const auto found = numbers_.find(landmark_id);
  return found == numbers_.end() ? -1 : found->second;
}

}  // namespace pf_resampling
