#pragma once

#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

#include "pf_resampling_core/smoothing/cross_validation.hpp"
#include "pf_resampling_core/smoothing/reassociation.hpp"
#include "pf_resampling_core/smoothing/smoother.hpp"

namespace pf_resampling {

/// What a population is redrawn from, as it is saved: nothing if there is no pose.
struct SmoothedPastState {
  SmoothingGraph graph;
  std::vector<std::int64_t> landmark_ids;  ///< of each landmark of the graph; -1: forgotten
  std::vector<int> last_seen;              ///< pose from which each of them was seen last
  /// Of landmarks that the particles have given up, but that may be others seen elsewhere, of which
  /// the odometry is too uncertain to tell.
  std::vector<bool> is_dormant;
  int longest_absence = 0;  ///< updates without the landmarks of the last one
  int decided = 0;          ///< poses whose sightings have had their landmarks decided
  double time = 0.0;        ///< s, of the newest pose since the start
  double validated = 0.0;   ///< s, up to where blocks were left out and predicted
  /// Of the passages and windows up to there, the newest last.
  std::vector<PredictedBlock> passages;
  std::vector<PredictedBlock> windows;
};

/// What a population is redrawn from: the belief it began with and all data since, each observation
/// as of the landmark that most of the weight took it for. A pose per update.
class SmoothedPast {
 public:
  bool is_empty() const { return state_.graph.poses.empty(); }
  void clear();
  /// The same, but what was found of the noise stays for the next drive.
  void forget_drive();

  /// Begins at a belief about the pose, the constants and these landmarks, in the prior's order.
  void start(const GaussianPrior& prior, const std::vector<std::int64_t>& landmark_ids);
  /// Goes on from there.
  void resume(const SmoothedPastState& state);

  /// An update: the odometry that led to it; then what was seen, each a landmark that is there, or
  /// a new one, in place of any that had its id.
  void append(const MotionFactor& motion);
  void append_sighting(std::int64_t landmark_id, bool is_new, SightingFactor sighting);
  /// Of no landmark known.
  void append_unassigned(SightingFactor sighting);
  /// Its sightings are of no landmark from now on.
  void forget_landmark(std::int64_t id);
  /// The particles have given it up: no landmark any more, if it was not seen often; else it is
  /// dormant until it is seen again, or until a solution finds that it is another.
  void give_up_landmark(std::int64_t id);

  /// Whether the last update saw a landmark that the `absence` updates before it did not see.
  bool closes_loop(int absence) const { return state_.longest_absence >= absence; }

  /// Solves for all of it, from the last solution; see smooth(). Landmarks that were forgotten
  /// leave the graph.
  SmoothingResult solve(const SmoothingOptions& options);
  /// The same where landmarks have no ids. What came back into view since the last solution counts
  /// as another landmark, with an id from `next_id` on, until it is clear that it is not; landmarks
  /// that are one become one, under the id of the older; and sightings may change their landmarks,
  /// as long as that makes all of it more likely. What is new, what was seen since arrivals and, in
  /// its turn, one visit of the past are decided anew. See find_duplicates(), reassociate(),
  /// track_anew().
  SmoothingResult solve(const SmoothingOptions& options, const ReassociationOptions& reassociation,
                        std::int64_t* next_id);

  /// After solve(): leaves out and predicts what has been completed since the last call, a few
  /// blocks at most, and states the noise by how well that went, from the next solve() on; see
  /// noise_scales().
  void validate(double robust_width);
  void take_noise_as_stated() { state_.graph.noise = {}; }

  /// After solve(): once there are half as many poses more than `window`, the oldest are forgotten
  /// down to that; see forget_oldest().
  void bound(int window, double robust_width);

  const SmoothedPastState& state() const { return state_; }
  const SmoothingGraph& graph() const { return state_.graph; }
  /// Number of a landmark in the graph by its id; -1: none.
  int number_of(std::int64_t landmark_id) const;

 private:
  void remove_forgotten();
  void forget_unseen();
  void wake_seen();
  bool part_arrivals(const ReassociationOptions& options, std::int64_t* next_id);
  bool merge_duplicates(const SmoothingOptions& options, const ReassociationOptions& reassociation,
                        SmoothingResult* solution);
  bool improve_associations(const SmoothingOptions& options,
                            const ReassociationOptions& reassociation, SmoothingResult* solution);
  bool simplify(const SmoothingOptions& options, const ReassociationOptions& reassociation,
                SmoothingResult* solution);
  bool do_without(const SmoothingOptions& options, const ReassociationOptions& reassociation,
                  const Dispensable& landmark, SmoothingResult* solution);
  SmoothingResult settle(const SmoothingOptions& options,
                         const ReassociationOptions& reassociation);
  /// Poses from one arrival to the next.
  struct Visit {
    int from = 0;
    int to = 0;  ///< one more than the last
  };
  std::vector<Visit> doubtful_visits() const;
  std::vector<Visit> visits() const;
  void reconsider_visit(const SmoothingOptions& options, const ReassociationOptions& reassociation,
                        std::int64_t* next_id, SmoothingResult* solution);
  bool decide_anew(const SmoothingOptions& options, const ReassociationOptions& reassociation,
                   const Visit& visit, std::int64_t* next_id, SmoothedPast* best,
                   SmoothingResult* solution) const;
  int add_landmark(std::int64_t id, int pose);
  void merge(const std::vector<std::pair<int, int>>& pairs);

  SmoothedPastState state_;
  std::unordered_map<std::int64_t, int> numbers_;  // of landmark_ids
};

}  // namespace pf_resampling
