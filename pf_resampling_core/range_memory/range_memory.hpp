#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "pf_resampling_core/models/beacon_range.hpp"
#include "pf_resampling_core/models/odometry_motion.hpp"
#include "pf_resampling_core/population/pose_estimate.hpp"
#include "pf_resampling_core/range_memory/range_graph.hpp"

namespace pf_resampling {

class Archive;

/// What is believed of radios, antenna and odometry before there are data; standard deviations.
struct RangeMemoryOptions {
  double sigma = 1.0;       ///< m, of a range that states none; a factor is found from the data
  double surveyed = 0.02;   ///< m, of a listed place that states none, along each axis
  double unknown = 1000.0;  ///< m, of a place that is not listed
  double scale = 0.05;      ///< of all ranges
  double bias = 0.5;        ///< m, of all ranges
  double own_scale = 0.01;  ///< of each radio beside that
  double own_bias = 0.1;    ///< m
  double height = 1.5;      ///< m over the antenna, of a radio whose height is not stated
  /// Wheels are 2 % off, as a rule, and what they are off by looks like a bias of the ranges.
  double distance_scale = 0.02;
  double turn_scale = 0.02;
  double metre = 0.02;            ///< of distances, where nothing else says how long a metre is
  double tight = 0.2;             ///< share of these that is left of a LooseError that is not there
  double yaw_rate = 0.01;         ///< rad/s
  double yaw_rate_walk = 1.3e-5;  ///< rad/s/sqrt(s)
  double lever = 0.3;             ///< m, of the antenna where it is said to be at the base's origin
  double lever_height = 0.5;      ///< m, likewise
  double stated_lever = 0.01;     ///< m, where it is said to be elsewhere
  double noise_spread = 0.7;      ///< of the logarithm of the odometry's factors of noise
  double fault_odds = 1e-2;       ///< that a first radio is wrong, before there are data
  /// Keyframes that are solved for, fewer among many radios; what older ones say stays as a
  /// Gaussian.
  int most_keyframes = 1000;
};

/// What is said of a radio.
enum class RadioAccount {
  as_listed,
  elsewhere,  ///< its place is not the listed one
  biased,     ///< its ranges are too long or too short by more than radios differ
  mistaken,   ///< it is where another one is listed: swapped with that, or repeating its ranges
  unlisted,   ///< nobody said where it is
};

/// Errors that are taken for small, unless the data say otherwise: were all of them free, each
/// would make every pose less sure where none is there.
struct LooseError {
  enum Index : std::size_t {
    radios,   ///< scale and bias of each beside those of all
    heights,  ///< of radios whose height is not stated
    count
  };
};
using LooseErrors = std::array<bool, LooseError::count>;

/// Measured over true motion, where the odometry is grossly wrong: wheels that count several times
/// or in part, a turn that is counted the wrong way.
struct OdometryFactors {
  double distance = 1.0;
  double turn = 1.0;
};
inline bool operator!=(const OdometryFactors& a, const OdometryFactors& b) {
  return a.distance != b.distance || a.turn != b.turn;
}

/// A place where a radio may be.
struct RadioPlace {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();    ///< m, map frame
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< m^2
  double probability = 1.0;
};

/// A way to understand the data: a path, places and constants.
struct RangeMode {
  std::vector<RadioAccount> accounts;  ///< of each radio
  LooseErrors loose = {};
  RangePrior prior;
  RangeEstimate estimate;
  RangeBelief belief;
  std::optional<RangePast> past;     ///< what left the graph
  std::optional<RangePast> settled;  ///< from which on keyframes move between solutions of all
  double probability = 1.0;          ///< among the modes
};

inline bool has_mistake(const RangeMode& mode) {
  return std::find(mode.accounts.begin(), mode.accounts.end(), RadioAccount::mistaken) !=
         mode.accounts.end();
}

/// What is known of a radio.
struct RadioKnowledge {
  int id = 0;
  RadioAccount account = RadioAccount::as_listed;  ///< another one where that is nearly sure
  int ranges = 0;
  double fault = 0.0;  ///< probability that it is not as listed
  /// Of the best mode; more than one where another place explains the ranges about as well. Empty
  /// while it cannot be told.
  std::vector<RadioPlace> places;
  RangeCalibration calibration;  ///< sigma: of a range
  double scale_sigma = 0.0;
  double bias_sigma = 0.0;  ///< m
  /// The radio at whose listed place this one seems to be: repeated, or swapped. -1: none.
  int in_place_of = -1;
  bool repeats = false;  ///< what that one measures, to the bit: it takes no part
};

struct RangeInnovation {
  int radio = 0;       ///< id
  double value = 0.0;  ///< m
  double sigma = 0.0;  ///< m, expected standard deviation
};

/// Wheels that slipped, or a robot that was carried.
struct RangeSlip {
  double begin = 0.0, end = 0.0;  ///< s, from the first odometry
  double size = 0.0;              ///< m, error of the odometry in that time
  Pose2 pose;                     ///< where it began
};

/// All ranges and odometry of a drive, and what least squares says of them: path, scale and bias of
/// the radios, places of those that are not listed, errors of the odometry and of the antenna's
/// place, and which radio is not as listed. One graph for listed and other radios: a place is an
/// unknown with a prior. Of a long drive the oldest keyframes leave the graph; what they say of all
/// else stays, but of listed radios that are not heard any more.
class RangeMemory {
 public:
  /// `beacons`: those whose place is known. `calibration`: by id, -1 for all others; as the filter
  /// has it. `first`: where the robot is, if that is known; with fewer than two beacons the frame
  /// is that in which its pose is this, or else zero, when it drives off. Throws Error if two have
  /// one id.
  RangeMemory(const RangeMemoryOptions& options, const std::vector<Beacon>& beacons,
              const RangeCalibrations& calibration = {},
              const std::optional<PoseEstimate>& first = {});
  /// To be read from a file.
  RangeMemory() : RangeMemory(RangeMemoryOptions{}, {}) {}
  /// Goes on to the bit as `saved`, whose options, beacons and calibration are not part of it,
  /// would have with those of this one. Nothing happens, and false, if it is of other beacons.
  bool resume(const RangeMemory& saved);
  friend void describe(Archive& archive, RangeMemory& memory);  ///< as it is saved

  /// The robot moved, then measured; a range of a radio that is not listed makes it known.
  void add(const OdometryIncrement& odometry, const std::vector<RangeObservation>& ranges);
  /// Whether the best mode explains most ranges of the last ten seconds: false after the robot was
  /// carried off.
  bool explains_newest() const;
  /// Whether the wheels slipped within the last seconds, as the ranges say.
  bool has_slipped() const;
  /// In what graph() holds.
  std::vector<RangeSlip> slips() const;

  /// solve_all() if it is due, else follow(). True if it was due.
  bool solve();
  /// Whether solve_all() is due: at first, where the newest ranges do not fit, and ever more rarely
  /// as the drive grows.
  bool is_due() const;
  /// Solves with all data so far: starts where the ranges allow it, and tries other places,
  /// accounts and noise.
  void solve_all();
  /// The modes with the newest data: only the newest keyframes move. False if there are none.
  bool follow();

  /// Those whose place is known.
  const std::vector<Beacon>& beacons() const { return beacons_; }
  /// The most probable first; none before the ranges allow a start.
  const std::vector<RangeMode>& modes() const { return modes_; }
  const RangeGraph& graph() const { return graph_; }
  const RangeNoise& noise() const { return noise_; }
  /// By which the odometry in graph() was divided.
  const OdometryFactors& odometry_factors() const { return odometry_factors_; }
  /// A short motion divided by them: to first order in its turn.
  OdometryIncrement without_factors(OdometryIncrement motion) const;
  /// By which factor deviations of means over ten seconds exceed what independent errors make.
  double doubt() const { return doubt_; }
  /// The listed ones, then others as they were heard.
  std::vector<RadioKnowledge> radios() const;
  /// The listed beacons, and all others that were found at one place: another memory can begin with
  /// them.
  std::vector<Beacon> found() const;
  /// Whether a radio may be at more than one place.
  bool is_ambiguous() const;
  /// Whether there were enough ranges to find radios that are not as listed.
  bool are_judged() const { return are_judged_; }
  /// Whether the robot may well be elsewhere: if another radio is wrong than the most probable mode
  /// says.
  bool is_torn() const;
  /// The newest range less what was expected of it, m; nothing while that is not known.
  std::optional<RangeInnovation> innovation() const;
  /// Place among the constants of a radio that was heard: see radio_at().
  std::optional<int> number_of(int id) const;

  /// A mode at the newest time.
  struct Newest {
    Eigen::VectorXd mean;        ///< KeyframeUnknown, then constants
    Eigen::MatrixXd covariance;  ///< likewise
  };
  Newest newest(const RangeMode& mode) const;
  /// s, from the first odometry to the newest
  double time() const { return time_; }
  /// s, of each keyframe of the graph
  const std::vector<double>& keyframe_times() const { return times_; }

  /// That was heard.
  struct Radio {
    int id = 0;
    std::optional<Beacon> listed;
    RangeCalibration calibration;
    int ranges = 0;
    std::vector<RadioPlace> other_places;  // `probability` over that of the one in use
    double newest = 0.0;                   // m, that it measured itself
    double copied = 0.0;                   // share of its newest ranges that were another's
    int copies = -1;                       // id of that one
    bool repeats() const { return copied > 0.5; }
  };

 private:
  static constexpr int kKeyframe = KeyframeUnknown::count;
  static constexpr std::size_t kMostRadios = 40;  // that are heard at a time
  static constexpr int kRingPlaces = 32;
  static constexpr std::size_t kRefined = 16;  // of first poses
  static constexpr std::size_t kRefinedOfMany = 5;
  static constexpr double kSamePlace = 0.5;    // m, of two modes
  static constexpr double kModeMargin = 10.0;  // of the logarithm of the evidence
  static constexpr int kIterations = 8;
  static constexpr int kManyIterations = 30;
  static constexpr double kElsewhere = 3.0;  // m, standard deviation of a place that is wrong
  static constexpr double kRigid = 60.0;     // s that odometry alone has the shape of the path
  static constexpr double kFound = 1.0;      // m, largest standard deviation of a place

  /// A minimum of the cost of one radio's ranges, given a path.
  struct Fix {
    Eigen::Vector2d position;
    Eigen::Matrix2d covariance;
    double cost;
    double distance;  ///< m, typical
  };

  /// A radio whose newest ranges are not as those before, and how many these are.
  struct Change {
    int radio = 0;
    int ranges = 0;
  };

  std::optional<int> radio_of(int id);
  const Beacon* listed(int id) const;
  RadioKnowledge knowledge_of(int id) const;
  bool has_begun();
  void begin_anew(const OdometryFactors& factors);
  void add_keyframe();
  double spacing() const;
  RangePrior prior() const;
  Eigen::VectorXd sigmas(const std::vector<RadioAccount>& accounts, const LooseErrors& loose) const;
  bool may_be_loose(LooseError::Index error) const;
  void set_account(int radio, RadioAccount account, RangeMode* mode) const;
  void start();
  RangeMode as_listed() const;
  std::vector<std::pair<double, Pose2>> first_poses(const RangeMode& mode, int coarseness) const;
  std::vector<RangeMode> starts(const RangeMode& mode, std::size_t refined,
                                RangeNoise* noise) const;
  void weigh_modes();
  std::vector<Fix> fixes(int radio, const RangeMode& mode) const;
  void let_radios_enter(RangeMode* mode);
  void try_other_places(RangeMode* mode);
  void try_all_places_anew(RangeMode* mode);
  bool try_gross_odometry();
  bool contradicts_odometry() const;
  void try_slip();
  void judge_suspected_motions();
  bool has_slipped_since(double begin) const;
  bool distrust_newest(double span);
  Eigen::Matrix3d slip_covariance_of(const OdometryIncrement& motion) const;
  static bool are_at_one_place(const RangeMode& a, const RangeMode& b);
  static double median_of(std::vector<double> values);
  double residual_in(const RangeMode& mode, std::size_t keyframe, const HeldRange& range) const;
  double excess_of(int radio, const RangeMode& mode) const;
  std::optional<Change> newest_change() const;
  void forget_before(const Change& change);
  void note_copy(double range, Radio* radio) const;
  void leave_out(int radio);
  void judge_radios();
  double heading_spread(const RangeMode& mode) const;
  std::vector<bool> suspicious(const RangeMode& mode) const;
  std::optional<RangeMode> with_other_error(const RangeMode& mode, LooseError::Index error) const;
  std::optional<RangeMode> with_fault(const RangeMode& mode, int radio, RadioAccount account,
                                      int cleared) const;
  std::vector<RangeMode> with_mistakes(const RangeMode& mode,
                                       const std::vector<bool>& is_suspicious) const;
  double log_probability(const RangeMode& mode) const;
  void learn_noise();
  bool try_noise(double least_of_ranges);
  void find_doubt();
  bool may_head_anywhere() const;
  bool is_too_large() const;
  void let_oldest_leave();
  void forget(int radio);
  bool are_listed() const;
  int newest_keyframes() const;
  static int first_that_moves(const RangeMode& mode);
  void solve_newest(RangeMode* mode) const;
  void settle(RangeMode* mode) const;
  bool solved(int iterations, RangeMode* mode,
              double least_evidence = -std::numeric_limits<double>::infinity()) const;
  double log_prior_of_noise(const RangeNoise& noise) const;

  RangeMemoryOptions options_;
  std::vector<Beacon> beacons_;
  RangeCalibrations calibration_;
  std::optional<PoseEstimate> first_;
  std::vector<Radio> radios_;  // that were heard
  RangeGraph graph_;
  std::vector<double> times_;
  OdometryIncrement pending_;  // since the newest keyframe
  bool holds_newest_ = false;  // range
  double time_ = 0.0;
  bool lever_is_stated_ = false;
  OdometryFactors odometry_factors_;
  RangeNoise noise_;
  std::vector<RangeMode> modes_;
  double next_solution_of_all_ = 0.0;  // s
  double doubt_ = 1.0;
  bool are_judged_ = false;
  bool has_turned_ = false;  // when radios were last judged
  int next_trial_ = 0;
  std::array<double, 4> trial_steps_ = {2.0, 2.0, 2.0, 1.5};  // of RangeNoise
};

}  // namespace pf_resampling
