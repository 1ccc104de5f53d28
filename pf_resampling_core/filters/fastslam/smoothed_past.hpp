#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "pf_resampling_core/smoothing/smoother.hpp"

namespace pf_resampling {

/// What a population is redrawn from: the belief it began with and all data since, each observation
/// as of the landmark that most of the weight took it for. A pose per update.
class SmoothedPast {
 public:
  bool is_empty() const { return graph_.poses.empty(); }
  void clear();

  /// Begins at a belief about the pose, the constants and these landmarks, in the prior's order.
  void start(const GaussianPrior& prior, const std::vector<std::int64_t>& landmark_ids);

  /// An update: the odometry that led to it; then what was seen, each a landmark that is there, or
  /// a new one, in place of any that had its id.
  void append(const MotionFactor& motion);
  void append_sighting(std::int64_t landmark_id, bool is_new, SightingFactor sighting);
  void forget_landmark(std::int64_t id);

  /// Whether the last update saw a landmark that the `absence` updates before it did not see.
  bool closes_loop(int absence) const;

  /// Solves for all of it, from the last solution; see smooth().
  SmoothingResult solve(const SmoothingOptions& options);

  /// After solve(): once there are half as many poses more than `window`, the oldest are forgotten
  /// down to that; see forget_oldest().
  void bound(int window, double robust_width);

  const SmoothingGraph& graph() const { return graph_; }
  /// Number of a landmark in the graph by its id; -1: none.
  int number_of(std::int64_t landmark_id) const;

 private:
  SmoothingGraph graph_;
  std::unordered_map<std::int64_t, int> numbers_;
  std::vector<int> last_seen_;  // pose, by landmark
  int longest_absence_ = 0;     // updates, of the landmarks of the last one
};

}  // namespace pf_resampling
