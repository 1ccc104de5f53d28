#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "pf_resampling_core/filters/fastslam/landmark_store.hpp"
#include "pf_resampling_core/filters/fastslam/memory/landmark_index.hpp"
#include "pf_resampling_core/filters/fastslam/memory/memory.hpp"
#include "pf_resampling_core/filters/fastslam/memory/sensor_view.hpp"
#include "pf_resampling_core/filters/fastslam/odometry_errors.hpp"
#include "pf_resampling_core/filters/fastslam/options.hpp"
#include "pf_resampling_core/filters/fastslam/particle_paths.hpp"
#include "pf_resampling_core/filters/fastslam/particles.hpp"
#include "pf_resampling_core/filters/fastslam/relocalization.hpp"
#include "pf_resampling_core/models/landmark_observation.hpp"
#include "pf_resampling_core/models/odometry_motion.hpp"
#include "pf_resampling_core/population/ancestry.hpp"
#include "pf_resampling_core/population/pose_estimate.hpp"
#include "pf_resampling_core/strategy/strategy.hpp"

namespace pf_resampling {

namespace kernels {
struct PoseGaussians;
}
struct SavedMap;

/// A landmark of the weighted-mean map.
struct LandmarkEstimate {
  std::int64_t id = 0;  ///< the observations' id where these are known, else in order of discovery
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();        ///< m, map frame
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< of the mixture over the particles
  double held = 0.0;                                     ///< share of the weight that holds it
  double log_odds = 0.0;  ///< of its existence, mean over the particles that hold it
};

/// What became of an observation of the last update.
struct ObservationOutcome {
  /// Id of the landmark it was taken as in the heaviest particle; -1: of none.
  std::int64_t landmark = -1;
  bool is_new = false;    ///< whether it started that landmark, or would have, had there been room
  double accepted = 0.0;  ///< share of the weight that believed it

  bool is_believed() const { return accepted >= 0.5; }
};

/// Health of the filter. Counts are since the start.
struct FastSlamStatus : PopulationStatus {
  int landmarks = 0;
  std::int64_t redraws_refused = 0;  ///< for want of a solution
  /// How well what was seen first after the last redraw fits it: the squared innovations of these
  /// observations in the whole population, over their degrees of freedom. 1 is expected; 0: nothing
  /// was seen yet. One of more than 13.8, such as a misread id, counts as 13.8.
  double redraw_innovation = 0.0;
  int redraw_innovation_observations = 0;  ///< how many these were
  /// Observations of known landmarks that most of the weight did not believe.
  std::int64_t gated = 0;
  /// Landmarks that were not taken into the map: MapOptions::max_landmarks or max_estimates.
  std::int64_t landmarks_refused = 0;
};

/// FastSLAM 2.0 and 1.0 (Kwak section 2; Montemerlo, Thrun, Koller, Wegbreit 2003): the particles
/// hold the path, each with an extended Kalman filter per landmark.
///
/// Same seed and same calls: same bytes.
class FastSlam {
 public:
  FastSlam(const FastSlamOptions& options, std::uint64_t seed);

  /// One step of the filter: draws the poses from odometry and observations, updates the landmarks,
  /// weighs, renews. All observations are of one scan, taken at the end of the odometry by a sensor
  /// at `sensor` on the robot. With known data association all need an id (from 0). Throws Error,
  /// changing nothing, on odometry or observations that cannot be used, or more of them than
  /// DataAssociationOptions::max_pairs.
  void update(const OdometryIncrement& odometry,
              const std::vector<RangeBearingObservation>& measured, const Pose2& sensor = {});

  /// Redraws whether it is due or not, so that path and map are what all data so far say. False,
  /// with the population as it was, unless the renewal is redraw and there is a solution.
  bool smooth();

  /// Weighted mean and covariance of the whole population.
  PoseEstimate estimate() const;

  /// The belief about the pose in the map: estimate() with the covariance that is left where the
  /// beginning of each particle's map is laid on that of the mean map, however uncertain it is
  /// where the robot started. estimate() where there are no two landmarks. O(M).
  PoseEstimate place();

  /// By what factor noise may be larger than it was found to be; see noise_doubt() of
  /// cross_validation.hpp. 1 where the noise is not learnt: it is as stated.
  double noise_doubt() const;

  /// The motion since the last update as the filter sees it: without the systematic errors of the
  /// odometry that it has learnt. From estimate() on, by the odometry's clock.
  OdometryIncrement corrected(const OdometryIncrement& since) const {
    return odometry_errors_.corrected(with_found_noise(since), particles_.weight);
  }

  /// A landmark of the weighted-mean map by its id; nothing if the map has none of that id, or
  /// data association is not by ids. O(M).
  std::optional<LandmarkEstimate> landmark(std::int64_t id);

  /// The weighted-mean map. Brings every landmark up to date: O(M·N).
  std::vector<LandmarkEstimate> map();

  /// As after construction.
  void reset();

  /// Goes on from a saved map, to the bit if all of the population was saved and options and seed
  /// are the same; if it has another number of particles, so many are drawn from it. With
  /// map/frozen, every particle gets the weighted-mean map instead, of the landmarks that most of
  /// the weight holds, with the covariances of the mixture. Without particles in `map`, every
  /// particle gets that map and a pose drawn from its pose estimate. Counts of the status start
  /// anew. Throws, changing nothing: Error for a map that makes no sense, is larger than the limits
  /// in MapOptions, or whose landmarks have no ids where association/method is known.
  void load(const SavedMap& map);

  /// After load(): this is another drive, and the robot may have been carried since the last. Until
  /// what it sees shows where it is, is_placed() is false, and nothing is learnt from what does not
  /// fit.
  void begin_drive();
  bool is_placed() const { return unplaced_since_ < 0.0; }

  /// Draws every particle's pose from a Gaussian (what rviz calls initial pose); all weigh the same
  /// and keep their maps. Throws Error, changing nothing, for a covariance that is not one.
  void set_poses(const PoseEstimate& poses);

  /// Finds a robot that was carried away, when options().recovery is enabled and landmarks have
  /// ids. To be called after each update() with observations: with these, their stamp (ns), and the
  /// probability that the filter is lost (LostDetector). Once that is likely, and what was seen in
  /// the last seconds fits the map from one pose (relocalize()), all particles are put there.
  /// Returns that pose, or nothing if they stay where they are.
  std::optional<PoseEstimate> recover(const std::vector<RangeBearingObservation>& observations,
                                      const Pose2& sensor, std::int64_t stamp, double lost);

  /// Takes over other options. Particles, weights and maps stay bit-identical; another particle
  /// count takes effect at the next update, other odometry_errors at the next reset(). Throws
  /// Error, changing nothing, on options that make no sense, on data association by ids while there
  /// are landmarks that were found without, and on limits that the map goes beyond.
  void set_options(const FastSlamOptions& options);

  const FastSlamOptions& options() const { return options_; }
  /// Of the random streams: grows with every update() and set_poses().
  std::uint32_t step() const { return step_; }
  const FastSlamParticles& particles() const { return particles_; }
  /// Systematic errors of the odometry, of every particle.
  const OdometryErrorEstimator& odometry_errors() const { return odometry_errors_; }
  const FastSlamStatus& status() const { return status_; }
  /// The robot's path as it is believed now, a pose for every call of update() since the start, the
  /// last load() or set_poses(), the oldest first: the particles' own paths, weighted.
  std::vector<Pose2> path() const { return paths_.mean(particles_.weight); }
  /// What a redraw draws from, empty unless the renewal is one; its graph has the noise as it was
  /// found.
  const Memory& memory() const { return memory_; }
  /// Factors of the standard deviations as stated that were found.
  const NoiseScales& noise() const { return memory_.graph().noise; }
  /// The method of data association in use; automatic until the first observations decide.
  DataAssociation association() const { return association_; }
  /// Of the last update's observations, in their order.
  const std::vector<ObservationOutcome>& outcomes() const { return outcomes_; }
  /// Particles' maps, for evaluation.
  LandmarkStore& store() { return store_; }
  /// Rows of the store in use.
  std::vector<int> rows() const;
  /// Id of a row's landmark as in LandmarkEstimate.
  std::int64_t id_of(int row) const { return store_.birth(row); }

 private:
  friend SavedMap saved_map(FastSlam* filter, int particles);

  // What an observation is taken as: in each particle one row, or a new landmark, or nothing.
  struct Association {
    std::vector<int> rows;     // candidates
    Eigen::ArrayXXd takes;     // per candidate a column, 1 in the particles that take it
    Eigen::ArrayXXd accepted;  // of these, where the proposal believed it
    Eigen::ArrayXd starts;     // 1 in the particles in which it is a new landmark
    int started_row = -1;
  };
  struct CandidatePair {
    double log_likelihood;
    int observation;
    int candidate;
  };

  bool all_have_ids() const;
  bool has_room_for_landmark() const;
  void take_map(const SavedMap& map);
  DataAssociation method_for(const std::vector<RangeBearingObservation>& observations) const;
  kernels::PoseGaussians proposal();
  void draw();
  void learn_odometry_errors();
  void associate(const std::vector<RangeBearingObservation>& observations, const Pose2& sensor);
  void associate_known(const std::vector<RangeBearingObservation>& observations, std::size_t k);
  void associate_by_likelihood(const std::vector<RangeBearingObservation>& observations,
                               const Pose2& sensor);
  void choose(Eigen::Index particle, const std::vector<Eigen::ArrayXXd>& distances,
              const std::vector<Eigen::ArrayXXd>& likelihoods);
  void start_landmark(std::size_t observation, const RangeBearingObservation& z,
                      const Pose2& sensor);
  double log_density_of_new() const;
  void weigh_new_landmarks();
  void doubt(std::size_t observation, const RangeBearingObservation& seen, const Pose2& sensor);
  void note_outcomes(const std::vector<RangeBearingObservation>& observations);
  void update_existence(const std::vector<RangeBearingObservation>& observations,
                        const Pose2& sensor);
  bool summarize(int row, LandmarkEstimate* landmark);
  Eigen::Vector2d representative(int row, Eigen::Index heaviest);
  void remove_landmark(int row);
  void forget(std::int64_t landmark);
  void normalize_weights();
  void renew();
  bool keeps_past() const;
  SensorConstants prior_sigma() const;
  OdometryIncrement with_found_noise(OdometryIncrement odometry) const;
  std::vector<RangeBearingObservation> with_found_noise(
      std::vector<RangeBearingObservation> observations) const;
  bool start_past();
  void note_past(const OdometryIncrement& odometry,
                 const std::vector<RangeBearingObservation>& observations, const Pose2& sensor);
  bool redraw(int size);
  bool count_refusal();
  void test_redraw(const std::vector<RangeBearingObservation>& observations, const Pose2& sensor);
  bool solve_memory();
  bool draw_from_memory(int size);
  void take_draw(int size, const MemoryDraw& drawn);
  void redraw_maps(int size, const MemoryDraw& drawn);
  void select(ConstIndices ancestors);
  void blend(const std::vector<BlendPair>& pairs);
  void draw_population(int size);
  void take_particles(const SavedMap& map);
  RandomStream stream(RandomPurpose purpose) const;

  FastSlamOptions options_;
  std::uint64_t seed_;
  DataAssociation association_ = DataAssociation::automatic;
  std::uint32_t step_ = 0;
  FastSlamParticles particles_;
  OdometryErrorEstimator odometry_errors_;
  LandmarkStore store_;
  LandmarkIndex index_;
  std::unordered_map<std::int64_t, int> row_of_id_;
  std::int64_t next_id_ = 0;
  Ancestry ancestry_;
  ParticlePaths paths_;
  Memory memory_;
  bool redraw_is_untested_ = false;
  bool is_lost_ = false;
  double unplaced_since_ = -1.0;  // s, of the memory; -1: the robot is placed
  bool has_landmarks_ = false;
  Strategy strategy_;
  int requested_size_ = 0;
  FastSlamStatus status_;
  std::vector<ObservationOutcome> outcomes_;
  RecentSightings sightings_{10'000'000'000, 60};  // ns
  std::vector<Association> associations_;
  SensorView view_;

  std::vector<CandidatePair> pairs_;
  std::vector<std::uint8_t> decided_;
  std::vector<int> taken_;
  Eigen::ArrayXXd proposal_;  // covariance: a column per entry
  Eigen::ArrayXd work_;
  Eigen::ArrayXXd drawn_;  // poses before the motion, then the motion itself: a row per particle
};

}  // namespace pf_resampling
