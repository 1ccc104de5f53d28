#pragma once

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>
#include <pf_resampling/FindingStatus.h>
#include <sensor_msgs/Imu.h>
#include <tf2_msgs/TFMessage.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pf_resampling_core/health/finding.hpp"
#include "pf_resampling_core/health/health.hpp"
#include "pf_resampling_core/health/lost_detector.hpp"
#include "pf_resampling_core/health/unknown_place.hpp"
#include "pf_resampling_core/parallel/take_overs.hpp"
#include "pf_resampling_core/population/pose_clusters.hpp"
#include "src/checkpoint/checkpoint.hpp"
#include "src/diagnostics/diagnostics.hpp"
#include "src/frames/static_frames.hpp"
#include "src/messages/rejects.hpp"
#include "src/odometry/dead_reckoning.hpp"
#include "src/odometry/imu_heading.hpp"
#include "src/pipeline/belief_publisher.hpp"
#include "src/pipeline/pipeline_options.hpp"
#include "src/pipeline/pipeline_sinks.hpp"

namespace pf_resampling {

/// A filter from messages to messages: no node handle, no clock, and no thread unless it is
/// deferred and solves for beacons. Without one, what it gives out depends on the messages, the
/// options and the seed alone.
///
/// Observations wait until odometry covers their stamps and are then used in order of time; the
/// pose goes out with every odometry message. What cannot be used changes nothing; it is counted by
/// input and reason, in `status` and in the diagnostics.
///
/// Whoever calls from outside, with a message, for a service or by a timer, does so through guard()
/// or ask(): no exception gets out of these, whatever its type.
///
/// This is what all filters have in common; a filter's own pipeline derives from it and fills in
/// the virtual functions below. `Types` names
///
///     Filter        the filter of the core
///     Message       what it observes, as a message with a header
///     Observations  what it observes, as the filter takes it
///     Options       PipelineOptions, with the filter's own in `filter`
///     Checkpoint    with `progress`
///     kNames        ObservationNames
///     presets()     of the filter
template <typename Types>
class FilterPipeline {
 public:
  using Filter = typename Types::Filter;
  using Message = typename Types::Message;
  using Observations = typename Types::Observations;
  using Options = typename Types::Options;
  using Checkpoint = typename Types::Checkpoint;
  static constexpr const char* kObservations = Types::kNames.topic;

  virtual ~FilterPipeline() = default;
  FilterPipeline(const FilterPipeline&) = delete;
  FilterPipeline& operator=(const FilterPipeline&) = delete;

  /// Runs `work`, which calls this pipeline. What it throws ends here: it is counted under `input`
  /// and said, and the filter goes on with its last belief and what odometry comes from now on.
  /// Returns whether nothing was thrown.
  bool guard(const char* input, const std::function<void()>& work);
  /// Likewise for a request, whose answer it returns. Error, which says why nothing was changed,
  /// is for the caller; whatever else is thrown becomes one.
  std::string ask(const char* request, const std::function<std::string()>& work);

  /// Counts a message that could not even be read.
  void note_unreadable(const std::string& input, const std::string& why) {
    reject(input, {RejectReason::unreadable, why});
  }

  void handle(const nav_msgs::Odometry& odometry) {
    if (options_.odometry_input.source == OdometrySource::topic) take_odometry(odometry);
  }
  /// A heading that is better than that of the wheels; see odometry_input/imu_heading.
  void handle(const sensor_msgs::Imu& imu);
  void handle(const Message& message);
  /// What rviz calls initialpose: the robot is put there; a map stays.
  void handle(const geometry_msgs::PoseWithCovarianceStamped& initial_pose);
  /// Of /tf_static and /tf: where the sensors are, and where odometry is if it comes that way.
  void handle(const tf2_msgs::TFMessage& transforms);

  /// Where odometry is taken from: a name among the inputs.
  const char* odometry_input() const {
    return options_.odometry_input.source == OdometrySource::tf ? "/tf" : "odom";
  }
  /// What else could be odometry, and how to take it; empty if nothing.
  std::string odometry_elsewhere() const;

  /// As after construction, but for what was counted.
  void reset() {
    odometry_.clear();
    imu_heading_.clear();
    forget_time({});
    start_anew();
  }
  /// All that is needed to go on as if nothing had happened, but for observations that wait;
  /// nothing while there is nothing to save. resume() goes on from there, or from such a file; it
  /// throws Error, with nothing changed, for a checkpoint that makes no sense or does not fit the
  /// options.
  std::optional<Checkpoint> checkpoint();
  void resume(const Checkpoint& checkpoint);
  void resume(const std::string& path) { resume(read_saved<Checkpoint>(kCheckpointFile, path)); }

  /// With options.deferred, what handle() is given only waits: a caller that takes all that has
  /// come before every call of this stays up to date whatever an update costs. Uses the next
  /// observation that odometry covers; when more than one waits, those older than max_latency are
  /// dropped first. Returns whether there was one.
  bool process_next();

  /// What is computed beside a deferred filter, and when it was taken over.
  TakeOvers& take_overs() { return take_overs_; }
  virtual bool works_beside() const { return false; }
  /// Observations that wait, in order of time.
  const std::deque<Message>& waiting() const { return waiting_; }

  /// Probability that the belief is wrong, as far as the position goes; 1 while there is none.
  double lost_probability() const;
  /// Whether the filter can be believed: what status, diagnostics and the panel say.
  HealthJudgement health() const;

  /// Takes over live parameters, all of them or none: particles and weights stay as they are, to
  /// the bit; another particle count takes effect at the next update, how the filter starts at the
  /// next start. A preset sets what was not given at the start; other values beside it win. Throws
  /// Error that says why none.
  void set_parameters(const std::map<std::string, std::string>& values);
  /// Those parameters, with present values: the preset, and all of the filter.
  ParameterList live_parameters() { return live_parameters(&options_); }
  /// Likewise of options that are not yet a pipeline's.
  static ParameterList live_parameters(Options* options);

  /// What has changed, or is wrong, in the order in which it was found.
  virtual std::vector<Finding> findings() const { return {}; }
  /// The same as in `status`.
  std::vector<FindingStatus> findings_in_words() const {
    return to_messages(findings(), first_odometry_.toSec());
  }

  /// Gives out status and diagnostics for a time at which messages do not come any more.
  void report_silence(ros::Time now);

  const RejectCounter& rejects() const { return rejects_; }
  int queued() const { return static_cast<int>(waiting_.size()); }
  /// How many messages of observations the filter has used.
  std::uint64_t used() const { return used_count_; }
  /// Why it has used none, as far as can be told.
  std::string why_none_used() const;
  /// Belief at the newest odometry; nothing before the first, or before the filter has started.
  std::optional<PoseEstimate> estimate() const {
    if (!belief_ || odometry_.empty()) return std::nullopt;
    return moved_by(*belief_, motion_since_update());
  }

 protected:
  FilterPipeline(const Options& options, const PipelineSinks& sinks);

  // ---- what a filter's own pipeline fills in --------------------------------------------------

  /// Why a message cannot be used, as far as it can be told when it comes.
  virtual std::optional<Rejection> fault_in(const Message& message) const = 0;
  /// Takes a transform that is no sensor's place on the robot; false for all others.
  virtual bool take_transform(const geometry_msgs::TransformStamped& /*transform*/) {
    return false;
  }
  /// Hands over observations that odometry or transforms have made complete.
  virtual void hand_over_observations() {}
  /// Observations closer than this, s, are used together; nothing: each is used alone.
  virtual std::optional<double> simultaneous() const { return std::nullopt; }
  /// What can be used of observations; rejects the rest. Nothing if that is all.
  virtual std::optional<Observations> to_observations(const std::vector<Message>& group) = 0;

  /// `used`: nothing if there is odometry alone.
  virtual void update_filter(const OdometryIncrement& odometry, const Observations& used) = 0;
  /// Takes up what has been computed beside the updates; returns whether the filter changed.
  /// The filter was updated, with or without observations: it stands at `stamp`.
  virtual void note_step(ros::Time /*stamp*/) {}
  /// The filter has used them; `duration`: s since the last ones, 0 for the first.
  virtual void note_observations(ros::Time stamp, const Observations& used, double duration) = 0;
  /// Time jumped: what was kept of observations is out of date.
  virtual void forget_observations() = 0;
  /// The robot was put elsewhere: what was kept of its past is out of date.
  virtual void forget_past() {}

  /// The belief of the filter, which is there; nothing while it has no population.
  virtual std::optional<PoseEstimate> belief_of_filter() { return filter_->estimate(); }
  virtual void put_robot(const PoseEstimate& there) = 0;
  virtual void restart_filter() { filter_->reset(); }
  /// The motion since the last update, without the errors that the filter knows.
  virtual OdometryIncrement motion_since_update() const = 0;
  /// m, of the scene the robot is in.
  virtual double extent(const PoseEstimate& belief) const = 0;
  /// The belief about the place among what is seen, as of the last update; there is one.
  virtual PoseEstimate place() const { return *belief_; }
  /// By what factor its deviations may be larger; at least 1.
  virtual double noise_doubt() const { return 1.0; }
  virtual void save_filter(Checkpoint* checkpoint) = 0;
  /// Throws Error, with nothing changed, if it cannot go on from there.
  virtual void load_filter(const Checkpoint& checkpoint) = 0;

  virtual void publish_map_if_due(ros::Time /*stamp*/) {}
  virtual void publish_path(ros::Time stamp) { publisher_.publish_path(stamp); }
  virtual visualization_msgs::MarkerArray markers(ros::Time stamp) = 0;
  virtual void fill_in(FilterStatus* status) const = 0;
  /// What stands in the way of a belief.
  virtual std::string waits_for() const = 0;
  /// What of a judgement of health is its own.
  virtual void add_health(HealthInputs* /*inputs*/) const {}
  virtual void diagnose(diagnostic_msgs::DiagnosticStatus* status) = 0;
  /// Adds entries of its own.
  virtual void add_diagnostics(ros::Time /*stamp*/, diagnostic_msgs::DiagnosticArray* /*array*/) {}

  // ---- what it can use ------------------------------------------------------------------------

  /// Begins with a filter that was not there before.
  void start(std::unique_ptr<Filter> filter);
  /// The filter as after construction, and the belief with it.
  void start_anew() {
    if (filter_) restart_filter();
    take_new_belief();
  }
  /// The filter was put elsewhere: what was before says nothing of it.
  void take_new_belief();
  /// The filter knows better.
  void take_belief() { belief_ = filter_ ? belief_of_filter() : std::nullopt; }
  void process_ready() {
    while (!options_.deferred && process_next()) {
    }
  }
  void reject(const std::string& input, const Rejection& rejection);
  void reject(const Rejection& rejection) { reject(Types::kNames.topic, rejection); }
  void log(LogLevel level, const std::string& text) const {
    if (sinks_.log) sinks_.log(level, text);
  }
  const OdometryNoise& noise() const { return options_.filter.odometry; }

  Options options_;
  PipelineSinks sinks_;
  TakeOvers take_overs_;
  std::unique_ptr<Filter> filter_;  // nothing while it cannot be made yet
  DeadReckoning odometry_;
  ImuHeading imu_heading_;
  std::optional<PoseEstimate> belief_;  // of the particles
  StaticFrames frames_;
  RejectCounter rejects_;
  BeliefPublisher publisher_;
  LostDetector lost_;
  ros::Time last_observation_;  // that was used

 private:
  void take_odometry(const nav_msgs::Odometry& odometry);
  void note_preset() const;
  void note_exception(const char* input, const char* what) noexcept;
  void start_about(const PoseEstimate& there, ros::Time stamp);
  void drop_far_ahead();
  void drop_oldest();
  void drop_late();
  bool is_covered(const Message& message) const {
    return !odometry_.empty() && message.header.stamp <= odometry_.newest();
  }
  bool is_duplicate(const Message& message) const;
  void note_used(const std::vector<Message>& group);
  void update(const std::vector<Message>& group);
  void move_on(const OdometryIncrement& motion, ros::Time stamp);
  void carry_belief_forward();
  void forget_time(const DeadReckoning::Taken& jump);

  void note_health(double duration);
  std::optional<PoseEstimate> place_now() const {
    if (!belief_ || odometry_.empty()) return std::nullopt;
    return moved_by(place(), motion_since_update());
  }
  double position_unknown(const PoseEstimate& place) const;
  void find_places();
  PoseClusters places_now() const;
  void add_places(ros::Time stamp, visualization_msgs::MarkerArray* markers);
  void publish_pictures(ros::Time stamp);
  void publish_status(ros::Time stamp);
  void publish_diagnostics(ros::Time stamp);
  diagnostic_msgs::DiagnosticStatus belief_diagnostic();

  std::string strategy_;
  std::string refused_;          // why parameters were refused last; empty once some were taken
  std::deque<Message> waiting_;  // in order of time
  std::deque<Message> used_;     // of which another may come that is not too old
  std::uint64_t used_count_ = 0;
  std::optional<std::pair<PoseEstimate, ros::Time>> pending_start_;  // before there is a filter
  ros::Time first_odometry_;
  UpdateTiming timing_;
  RecentMean sample_size_, descendants_;  // shares of the particles
  double update_time_ = 0.0;              // s, of the last
  double latency_ = 0.0;
  bool has_motion_on_tf_ = false;  // of the robot in the frame of the odometry
  std::uint64_t reported_drops_ = 0;
  std::uint64_t reported_rejects_ = 0;
  std::size_t reported_findings_ = 0;
  std::int64_t reported_weight_resets_ = 0;
  PoseClusters places_;  // where the robot may be, as of the last update that was asked for it
  std::size_t shown_places_ = 0;
  ros::Time last_markers_, last_status_, last_diagnostics_;
};

}  // namespace pf_resampling
