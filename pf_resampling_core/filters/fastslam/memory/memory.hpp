#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <unordered_map>
#include <vector>

#include "pf_resampling_core/filters/fastslam/memory/accounts.hpp"
#include "pf_resampling_core/filters/fastslam/memory/left_out.hpp"
#include "pf_resampling_core/filters/fastslam/memory/segment_graph.hpp"
#include "pf_resampling_core/filters/fastslam/memory/segment_solver.hpp"
#include "pf_resampling_core/smoothing/cross_validation.hpp"

namespace pf_resampling {

/// A belief to begin with, where there is one: means and joint covariance of (pose; landmarks;
/// constants), in the frame of the map.
struct StartingBelief {
  Pose2 pose;
  std::vector<Eigen::Vector2d> landmarks;
  std::vector<std::int64_t> landmark_ids;
  SensorConstants constants = SensorConstants::Zero();
  Eigen::MatrixXd covariance;
};

/// What a population is drawn from.
struct MemoryDraw {
  /// See draw_deviations(); wider by up to a half where landmarks are hard to tell apart.
  Eigen::MatrixXd deviations;
  std::vector<Eigen::Matrix2d> landmarks_given_path;
  OdometryInformation odometry_given_path = OdometryInformation::Zero();
};

/// Where the wheels slipped: the odometry of a segment is far from what all data say.
struct Slip {
  double begin = 0.0, end = 0.0;  ///< s since the start
  double square = 0.0;    ///< squared error in standard deviations, three degrees of freedom
  double distance = 0.0;  ///< m, by how much the odometry was off
  Pose2 pose;             ///< of the robot at the beginning
};

/// What a memory holds, as it is saved.
struct MemoryState {
  SegmentGraph graph;
  std::vector<RememberedLandmark> landmarks;
  std::vector<double> begins;            ///< s since the start, of each segment
  Segment open;                          ///< what came since the last of them, not condensed
  std::vector<std::size_t> open_doubts;  ///< sightings of it that did not fit, ascending
  /// Of the newest sightings, the newest last: the id of one that did not fit, -1 of one that did.
  std::vector<std::int64_t> newest;
  bool is_refused = false;      ///< whether the last time there was no solution
  double distrusted = 0.0;      ///< s, until when the odometry may be wrong
  std::size_t next_start = 0;   ///< segments from which a doubtful solution is started anew
  int next_scale_check = 16;    ///< updates from which the odometry's scales are looked at again
  bool scale_is_wrong = false;  ///< of the odometry, by far: to be solved for
  int updates = 0;
  int decided = 0;  ///< updates whose sightings have had their landmarks decided, without ids
  int longest_absence = 0;         ///< updates without the landmarks of the last one
  double time = 0.0;               ///< s since the start
  double closed = 0.0;             ///< s, up to where the segments reach
  double distance = 0.0;           ///< m, driven
  double speed = 0.0;              ///< m/s, mean over that
  double validated = 0.0;          ///< s, up to where passages were left out and predicted
  double windows_validated = 0.0;  ///< s, up to where windows were
  /// Passages and windows that were predicted, the newest last.
  std::vector<PredictedBlock> passages;
  std::vector<PredictedBlock> windows;
};

inline constexpr int kFewFitted = 4;  ///< sightings of a landmark that may be a mistake

/// The whole drive, in segments.
class Memory {
 public:
  bool is_empty() const { return state_.graph.bases.empty(); }
  void clear() { *this = Memory(); }
  /// The same, but what was found of the noise stays for the next drive.
  void forget_drive();

  /// Begins at a pose that is known, with constants known to `sigma`.
  void start(const Pose2& pose, const SensorConstants& sigma);
  /// Begins at a belief. False, changing nothing, unless its covariance is positive definite.
  bool start(const StartingBelief& belief);
  void resume(const MemoryState& state);

  /// An update: the odometry that led to it; then what was seen.
  void append(const MotionFactor& motion);
  void append_sighting(std::int64_t landmark_id, SightingFactor sighting);
  /// One that is not where its landmark is believed to be. Alone among others it is a misread id
  /// or a landmark that was moved, and takes no part; if many are such, or several in a row of
  /// which one was in view until then, the belief is wrong. One that does not fit more often than
  /// it did is of another landmark, or the same elsewhere, if it `may_be_another`.
  void append_doubtful_sighting(std::int64_t landmark_id, const SightingFactor& sighting,
                                bool may_be_another = true);
  /// A scan has seen this id at two places. If some have, it is that of two landmarks, and what
  /// does not fit is of the other one.
  void note_twice(std::int64_t landmark_id);
  /// Without ids: one that is of no landmark known.
  void append_unassigned(SightingFactor sighting);
  /// Without ids: the particles have given it up. It is dormant, if it was seen often, until it is
  /// seen again or found to be another; else it is none any more.
  void give_up_landmark(std::int64_t landmark_id);
  /// What is seen with this id from now on is another landmark, or the same elsewhere.
  void forget_landmark(std::int64_t landmark_id);

  /// Whether what is seen contradicts the belief.
  bool belief_is_wrong() const;
  bool has_doubts() const { return !state_.open_doubts.empty(); }
  /// With ids, after the sightings of an update: whether the odometry is grossly wrong shows before
  /// anything else does.
  void check_odometry_scales();
  /// Whether it should be solved for at once: unless that has just failed.
  bool needs_solution() const {
    return (belief_is_wrong() || state_.scale_is_wrong) && !state_.is_refused;
  }
  /// There was no solution.
  void note_refusal() { state_.is_refused = true; }
  /// Whether that was so a moment ago: wheels may be slipping.
  bool distrusts_odometry() const { return state_.time < state_.distrusted; }
  /// What slipping wheels add to the covariance of a motion, whatever they say of it.
  Eigen::Matrix3d slip_covariance_of(const Pose2& motion, double duration) const;
  /// Without ids: whether landmarks that should have been in view were not seen, more than the
  /// sensor misses. Then the robot is not where it believes, or the map is wrong.
  bool misses_landmarks() const { return misses_landmarks_; }

  /// Whether the last update saw a landmark that the `absence` updates before it did not see.
  bool closes_loop(int absence) const { return state_.longest_absence >= absence; }

  /// Solves for the whole drive, from the last solution. False if there is no solution: what came
  /// is kept, and takes part in the next.
  bool solve(double robust_width);
  /// The same where landmarks have no ids: decides what was seen, too, see decide_associations().
  bool solve(const ReassociationOptions& options, std::int64_t* next_id);
  /// After solve().
  MemoryDraw draw(int particles, const RandomStream& stream) const;
  /// Solves as if the robot had been carried to `newest` in one of the last segments. False,
  /// keeping the present solution, unless that explains the drive better; if it is known to have
  /// been carried `since` so many s since the start, rather than not at all (-1), it need not.
  bool solve_carried(double robust_width, const Pose2& newest, double since);
  /// After solve(): leaves out and predicts what has been completed since the last call, of a large
  /// map passages and windows in turn, and states the noise by how well that went, from the next
  /// solve() on.
  void validate(double robust_width);
  void take_noise_as_stated() { state_.graph.noise = {}; }

  const MemoryState& state() const { return state_; }
  const SegmentGraph& graph() const { return state_.graph; }
  std::size_t updates() const { return static_cast<std::size_t>(state_.updates); }
  /// Number of a landmark in the graph by its id; -1: none.
  int number_of(std::int64_t landmark_id) const;
  /// After solve(): of all updates, the first pose left out.
  std::vector<Pose2> path() const;
  std::vector<Slip> slips() const;

 private:
  struct Span {  // s since the start
    double begin = 0.0;
    double end = 0.0;
  };

  void note_newest(std::int64_t doubted);
  void believe_doubts();
  void leave_out_doubts();
  double cost_of_wrong_ids() const;
  std::vector<int> suspects() const;
  std::size_t leave_out_newest(int landmark);
  std::vector<Span> suspected_slips() const;
  bool distrust(const Span& span);
  void look_for_slips(double robust_width, double* evidence);
  SegmentSolution solve_for_all(double robust_width);
  SegmentSolution solve_closed(double robust_width);
  void join_settled(double robust_width);
  void condense_past();
  bool close_segments(double robust_width);
  bool close_before(double time, double robust_width);
  bool close(Segment segment, double robust_width);
  bool start_anew(double robust_width, SegmentGraph* graph) const;
  bool decide(const ReassociationOptions& options, std::int64_t* next_id);
  void number_landmarks();
  void look_for_missed();

  MemoryState state_;
  bool misses_landmarks_ = false;
  double ambiguity_ = 0.0;  // share of the newest sightings whose landmark is not sure
  std::unordered_map<std::int64_t, int> numbers_;      // of landmarks, by their ids
  std::shared_ptr<const SegmentEquations> equations_;  // factorised at the last solution
};

}  // namespace pf_resampling
