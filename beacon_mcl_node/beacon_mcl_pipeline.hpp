#pragma once

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>
#include <pf_resampling/BeaconArray.h>
#include <pf_resampling/BeaconRange.h>
#include <sensor_msgs/Range.h>
#include <tf2_msgs/TFMessage.h>

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "beacon_mcl_node/pipeline_options.hpp"
#include "beacon_mcl_node/range_sensor.hpp"
#include "pf_resampling_core/checkpoint/checkpoint.hpp"
#include "pf_resampling_core/filters/beacon_mcl/beacon_mcl.hpp"
#include "pf_resampling_core/health/lost_detector.hpp"
#include "src/diagnostics/diagnostics.hpp"
#include "src/frames/static_frames.hpp"
#include "src/messages/rejects.hpp"
#include "src/odometry/dead_reckoning.hpp"
#include "src/pipeline/belief_publisher.hpp"
#include "src/pipeline/pipeline_sinks.hpp"

namespace pf_resampling {

using BeaconMclSinks = PipelineSinks;

/// Range-beacon localization from messages to messages: no node handle, no clock, no thread. What
/// it gives out depends on the messages, the options and the seed alone.
///
/// Ranges wait until odometry covers their stamps and are then used in order of time; the pose goes
/// out with every odometry message. A message that cannot be used changes nothing; it is counted by
/// input and reason, in `status` and in the diagnostics.
class BeaconMclPipeline {
 public:
  /// Throws Error on options that make no sense.
  BeaconMclPipeline(const BeaconMclPipelineOptions& options, BeaconMclSinks sinks);

  void handle(const nav_msgs::Odometry& odometry);
  void handle(const BeaconRange& range);
  /// A range whose frame_id names the beacon; on its way to handle(BeaconRange).
  void handle(const sensor_msgs::Range& range);
  /// The beacons, once. Other ones later start the filter anew; ignored if the options have
  /// beacons.
  void handle(const BeaconArray& beacons);
  /// What rviz calls initialpose: the filter starts anew about it.
  void handle(const geometry_msgs::PoseWithCovarianceStamped& initial_pose);
  /// Of /tf_static and /tf: where the antennas are.
  void handle(const tf2_msgs::TFMessage& transforms);

  /// Services: starts anew from the ranges or over the area; starts from nothing.
  void global_localization();
  void reset();
  /// Puts particles in place of the present ones; returns what was set in one line, or throws Error
  /// with nothing changed.
  std::string set_particles(const geometry_msgs::PoseArray& poses,
                            const std::vector<double>& weights);

  /// All that is needed to go on as if nothing had happened, but for observations that wait;
  /// nothing while there is nothing to save. resume() goes on from there; it throws Error, with
  /// nothing changed, for a checkpoint that makes no sense or does not fit the options.
  std::optional<BeaconMclCheckpoint> checkpoint() const;
  void resume(const BeaconMclCheckpoint& checkpoint);

  /// With options.deferred, what handle() is given only waits: a caller that takes all that has
  /// come before every call of this stays up to date whatever an update costs. Uses the next
  /// observation that odometry covers; when more than one waits, those older than max_latency are
  /// dropped first. Returns whether there was one.
  bool process_next();

  /// Probability that the belief is wrong, or none.
  double lost_probability() const;

  /// Takes over live parameters, all of them or none: particles and weights stay as they are, to
  /// the bit; another particle count takes effect at the next update. Throws Error that says why
  /// none.
  void set_parameters(const std::map<std::string, std::string>& values);
  /// Those parameters, with present values.
  ParameterList live_parameters() { return live_parameters_of(&options_); }

  /// Gives out diagnostics for a time at which messages do not come any more.
  void report_silence(ros::Time now);

  /// Nothing while the beacons are not known.
  const BeaconMcl* filter() const { return filter_.get(); }
  const RejectCounter& rejects() const { return rejects_; }
  int queued() const { return static_cast<int>(ranges_.size()); }
  /// Belief at the newest odometry; nothing before the filter has started.
  std::optional<PoseEstimate> estimate() const;

 private:
  struct LatestRange {
    ros::Time stamp;
    double range = 0.0;
    double antenna_height = 0.0;
  };

  /// How a beacon does, as running means.
  struct BeaconHealth {
    double normalized_innovation = 1.0;  ///< squared innovation over its expected variance
    double period = 0.0;                 ///< s between its ranges; 0 until there were two
    ros::Time last;
  };

  std::unique_ptr<BeaconMcl> make_filter(const std::vector<Beacon>& beacons) const;
  void start_filter(const std::vector<Beacon>& beacons);
  void start_about(const PoseEstimate& start, ros::Time stamp);
  void process_ready();
  void drop_late();
  void update(const std::vector<BeaconRange>& group);
  std::optional<RangeObservation> to_observation(const BeaconRange& range);
  void note_health(ros::Time stamp, int beacon, double normalized_innovation);
  void carry_belief_forward();
  void take_belief();
  void forget_time(const DeadReckoning::Taken& jump = {});
  bool knows_beacon(int id) const;
  Rejection unknown_beacon(int id) const;
  void reject(const std::string& input, const Rejection& rejection);
  void log(LogLevel level, const std::string& text) const;

  void publish_pictures(ros::Time stamp);
  void publish_status(ros::Time stamp, double update_time);
  void publish_markers(ros::Time stamp);
  void publish_diagnostics(ros::Time stamp);
  diagnostic_msgs::DiagnosticStatus beacons_diagnostic(ros::Time stamp) const;

  BeaconMclPipelineOptions options_;
  BeaconMclSinks sinks_;
  const BeaconNames names_;
  std::string strategy_;
  std::string refused_;  // why parameters were refused last; empty once some were taken
  StaticFrames frames_;
  std::unique_ptr<BeaconMcl> filter_;
  DeadReckoning odometry_;
  std::deque<BeaconRange> ranges_;                                   // in order of time
  std::optional<std::pair<PoseEstimate, ros::Time>> pending_start_;  // before the beacons came

  std::optional<PoseEstimate> belief_;  // of the particles
  ScalarEstimate yaw_rate_bias_;

  RejectCounter rejects_;
  std::map<int, LatestRange> latest_ranges_;
  std::map<int, BeaconHealth> beacon_health_;
  BeliefPublisher publisher_;
  LostDetector lost_;
  UpdateTiming timing_;
  double latency_ = 0.0;
  std::uint64_t reported_drops_ = 0;
  std::uint64_t reported_rejects_ = 0;
  std::int64_t reported_weight_resets_ = 0;
  ros::Time last_range_;
  ros::Time last_markers_, last_beacons_, last_diagnostics_;
};

}  // namespace pf_resampling
