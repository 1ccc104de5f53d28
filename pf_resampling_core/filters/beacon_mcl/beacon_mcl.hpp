#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <future>
#include <memory>
#include <optional>
#include <vector>

#include "pf_resampling_core/filters/beacon_mcl/options.hpp"
#include "pf_resampling_core/filters/beacon_mcl/particles.hpp"
#include "pf_resampling_core/models/beacon_range.hpp"
#include "pf_resampling_core/models/odometry_motion.hpp"
#include "pf_resampling_core/parallel/take_overs.hpp"
#include "pf_resampling_core/parallel/worker_pool.hpp"
#include "pf_resampling_core/population/ancestry.hpp"
#include "pf_resampling_core/population/pose_estimate.hpp"
#include "pf_resampling_core/range_memory/range_memory.hpp"
#include "pf_resampling_core/strategy/strategy.hpp"

namespace pf_resampling {

struct SavedBeaconMcl;
namespace kernels {
struct Range;
struct RangeSums;
struct Weighing;
}  // namespace kernels

/// Health of the filter.
struct BeaconMclStatus : PopulationStatus {
  int observation = -1;  ///< beacon of the last range
  /// m, last range minus its prediction, weighted mean over the particles.
  double innovation = 0.0;
  double innovation_sigma = 0.0;  ///< m, its expected standard deviation
};

/// A systematic error as estimated, mean and standard deviation over the population.
struct CalibrationEstimate {
  int beacon = -1;  ///< id; -1 where shared by all
  double scale = 1.0;
  double scale_sigma = 0.0;
  double bias = 0.0;  ///< m
  double bias_sigma = 0.0;
};

struct ScalarEstimate {
  double mean = 0.0;
  double sigma = 0.0;
};

/// A range and the dead reckoning at its time.
struct RecentRange {
  RangeObservation observation;
  Pose2 pose;
  double time = 0.0;  ///< s, since the start
};

/// How far a filter has come, beside its population and memory.
struct BeaconMclProgress {
  std::uint32_t step = 0;                  ///< of the random streams
  double time = 0.0;                       ///< s, since the start
  std::int64_t updates_since_renewal = 0;  ///< when it is saved
  Pose2 dead_reckoning;                    ///< since the start
  std::optional<double> first_range_time;  ///< s
  double range_squares = 0.0;  ///< of the ranges' noise, in units of the nominal variance
  double range_count = 0.0;    ///< and of how many
  double slow_likelihood = 0.0;
  double fast_likelihood = 0.0;
  std::int64_t likelihoods = 0;
  double calibration_time = 0.0;      ///< s, when its variances were last carried forward
  std::vector<RecentRange> ranges;    ///< the oldest first
  bool is_drawn_from_memory = false;  ///< the population, several times a second
  double next_solution = 0.0;         ///< s
};

/// Monte Carlo localization by ranges to known beacons (Mahmoud section III): the particles hold
/// the pose, each with small Kalman filters for what is linear given the pose: scale and bias of
/// the ranges, yaw-rate bias of the dead reckoning (Rao-Blackwellised, as FastSLAM does for
/// landmarks).
///
/// Under Renewal::redraw a memory of all ranges estimates what more there is to know, with all
/// poses at once. As soon as it knows where the robot is, the population is drawn from it several
/// times a second, and ranges weigh no particles: what is not known of antenna, wheels and radios
/// is a part of the covariance. Among beacons of unknown places (BeaconPositions::estimated) it
/// finds these too. Before two beacons are known, the frame is that of the first pose.
///
/// Same seed and same calls: same bytes, at any number of threads.
class BeaconMcl {
 public:
  /// `beacons`: ids all different, at least one unless their places are estimated. `calibration`:
  /// the radios' known systematic errors by beacon id, -1 for all others; also the mean of the
  /// prior where they are estimated (where one for all is, differences between radios are believed
  /// as given). Throws Error on options that make no sense.
  BeaconMcl(const BeaconMclOptions& options, std::vector<Beacon> beacons, std::uint64_t seed,
            const RangeCalibrations& calibration = {});

  /// One step of the filter: moves the particles by `odometry`, weighs them by `ranges` (all taken
  /// at the end of the odometry), renews and excites when due. Odometry must be finite, ranges
  /// positive, at most 1e12 m and of known beacons, unless their places are estimated: what is not
  /// throws Error before anything has changed. Until there is a population (see Initialization)
  /// ranges only gather.
  void update(const OdometryIncrement& odometry, const std::vector<RangeObservation>& ranges);

  /// Whether there is a population yet.
  bool is_initialized() const { return particles_.size() > 0; }

  /// Weighted mean and covariance of the whole population. Only when is_initialized().
  PoseEstimate estimate() const;

  /// Starts anew about a pose; keeps what is known of calibration and yaw-rate bias. Throws Error,
  /// changing nothing, on what is not finite or has a negative variance.
  void initialize_gaussian(const Pose2& mean, const Eigen::Matrix3d& covariance);

  /// Starts anew over the whole area or from the latest ranges, as the options say; keeps
  /// calibration and bias.
  void global_localization();

  /// As after construction.
  void reset();

  /// The filter as it is now. Only when is_initialized().
  SavedBeaconMcl saved() const;

  /// Goes on from there, to the bit with the same options and seed; if the options say another
  /// number of particles, so many are drawn at the next update. Counts of the status start anew.
  /// Throws Error, changing nothing, for what was saved with other beacons, or with calibrations
  /// for others than are estimated; that all else is of a filter is believed.
  void load(const SavedBeaconMcl& saved);

  /// Takes over other options. Particles and weights stay bit-identical; another particle count
  /// takes effect at the next update. Only where an error is from now on estimated for others than
  /// before (calibration), or no longer or for the first time (yaw-rate bias, noise factors), that
  /// starts anew. Throws Error, changing nothing, on options that make no sense, or for another
  /// choice of beacon positions.
  void set_options(const BeaconMclOptions& options);

  const BeaconMclOptions& options() const { return options_; }
  const std::vector<Beacon>& beacons() const { return beacons_; }
  /// The beacons, and those that were found: RangeMemory::found().
  std::vector<Beacon> found_beacons() const;
  const BeaconMclParticles& particles() const { return particles_; }
  const BeaconMclStatus& status() const { return status_; }
  /// One for all (beacon -1) where it is estimated so and no differences are known, else one per
  /// beacon.
  std::vector<CalibrationEstimate> calibration() const;
  ScalarEstimate yaw_rate_bias() const;
  /// All that was measured and what least squares says of it, under Renewal::redraw; nothing
  /// otherwise.
  const RangeMemory* memory() const { return memory_ ? &*memory_ : nullptr; }
  /// Whether the population is what its most probable modes say.
  bool is_drawn_from_memory() const { return progress_.is_drawn_from_memory; }
  /// Solutions of all of it are made in a thread beside the filter, and taken over once they are
  /// there, or as `take_overs` says: no update waits, but what comes then depends on time. nullptr,
  /// as at first: they are not.
  void set_deferred_solutions(TakeOvers* take_overs) { take_overs_ = take_overs; }
  /// Whether there is one that was not taken over yet.
  bool is_solving() const { return solution_.has_value(); }
  /// Whether the memory says that this beacon is not as listed, in place or by a bias.
  bool is_not_as_listed(int beacon) const;
  /// Errors of distances and turns of the odometry as the memory knows them: the motion without
  /// them.
  OdometryIncrement without_known_errors(OdometryIncrement odometry) const;
  /// Where the range of this beacon is expected to be from, taking its calibration out of the
  /// measured range.
  double corrected_range(int beacon, double range) const;

 private:
  // A range of one radio, times scale plus offset, is what the first would have measured.
  struct RadioDifference {
    double scale = 1.0;
    double offset = 0.0;  // m
  };

  // A memory that is solved for in a thread of its own.
  struct Solution {
    std::future<RangeMemory> memory;
    /// What came since it began.
    std::vector<std::pair<OdometryIncrement, std::vector<RangeObservation>>> since;
    bool is_obsolete;  // the filter has begun another memory
  };

  bool calibrates() const { return options_.calibration.estimation != CalibrationEstimation::off; }
  bool finds_beacons() const { return options_.beacon_positions == BeaconPositions::estimated; }
  void start_memory(const std::optional<PoseEstimate>& first = {},
                    const std::optional<std::vector<Beacon>>& known = {});
  void note_innovation_of_memory();
  void solve_memory();
  void begin_solution();
  bool take_solution();
  void redraw(const std::vector<double>& shares, const std::vector<RangeMemory::Newest>& modes);
  WorkerPool::Body motion_of(const OdometryIncrement& odometry);
  kernels::Range range_of(const RangeObservation& observation);
  void weigh(const RangeObservation* observations, int count, const WorkerPool::Body& move);
  void normalize_weights(const double* likelihoods, int count, const WeightSums& sums);
  void follow_likelihood(double variance, double likelihood);
  void renew();
  void blend(const std::vector<BlendPair>& pairs);
  bool recovery_is_due() const;
  void inject();
  void learn_range_noise(const kernels::Weighing& weighing, int count,
                         const kernels::RangeSums& sums);
  double range_variance_factor() const;
  void vary_noise_factors();
  void remember(const RangeObservation& range);
  void initialize_when_possible();
  void initialize_uniform();
  void initialize_from_ranges();
  void reset_weights();
  void begin_population(bool first);
  void start_ancestry();
  CalibrationEstimate calibration_or_prior(std::size_t beacon) const;
  void start_calibration();
  void start_yaw_rate_bias();
  void start_noise_factors();
  std::vector<Pose2> propose_from_ranges(int count);
  std::size_t beacon_index(int id) const;
  RadioDifference difference_of(std::size_t beacon) const;
  double observation_variance(const RangeObservation& range) const;
  RandomStream stream(RandomPurpose purpose) const;

  BeaconMclOptions options_;
  std::vector<Beacon> beacons_;
  RangeCalibrations calibration_;          // as given
  std::vector<RangeCalibration> nominal_;  // per beacon
  std::uint64_t seed_;
  BeaconMclProgress progress_;

  std::optional<RangeMemory> memory_;
  TakeOvers* take_overs_ = nullptr;   // of solutions that are made in a thread of their own
  std::optional<Solution> solution_;  // under way

  BeaconMclParticles particles_;
  Ancestry ancestry_;
  Strategy strategy_;
  BeaconMclStatus status_;

  std::unique_ptr<WorkerPool> pool_;
  Eigen::ArrayXd work_;
};

}  // namespace pf_resampling
