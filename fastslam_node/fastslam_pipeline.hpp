#pragma once

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>
#include <pf_resampling/LandmarkMap.h>
#include <pf_resampling/LandmarkObservationArray.h>
#include <tf2_msgs/TFMessage.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "fastslam_node/pipeline_options.hpp"
#include "fastslam_node/recent_sightings.hpp"
#include "fastslam_node/tag_scans.hpp"
#include "pf_resampling_core/checkpoint/checkpoint.hpp"
#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"
#include "pf_resampling_core/health/lost_detector.hpp"
#include "src/diagnostics/diagnostics.hpp"
#include "src/frames/static_frames.hpp"
#include "src/messages/rejects.hpp"
#include "src/odometry/dead_reckoning.hpp"
#include "src/pipeline/belief_publisher.hpp"
#include "src/pipeline/pipeline_sinks.hpp"

namespace pf_resampling {

/// Where the messages of the pipeline go. What is empty is not made at all.
struct FastSlamSinks : PipelineSinks {
  std::function<void(const LandmarkMap&)> landmark_map;
  /// After every update, at the stamp of its scan: for evaluation of the particles and their maps.
  std::function<void(ros::Time, FastSlam*)> updated;
};

/// FastSLAM from messages to messages: no node handle, no clock, no thread. What it gives out
/// depends on the messages, the options and the seed alone.
///
/// The map frame is where the robot was at the first odometry, unless an initial pose or a loaded
/// map say otherwise. Scans wait until odometry covers their stamps and are then used in order of
/// time; the pose goes out with every odometry message. What cannot be used changes nothing; it is
/// counted by input and reason, in `status` and in the diagnostics.
class FastSlamPipeline {
 public:
  /// Throws Error on options that make no sense, or a map file that cannot be used.
  FastSlamPipeline(const FastSlamPipelineOptions& options, FastSlamSinks sinks);

  void handle(const nav_msgs::Odometry& odometry);
  void handle(const LandmarkObservationArray& scan);
  /// What rviz calls initialpose: the robot is put there; the map stays.
  void handle(const geometry_msgs::PoseWithCovarianceStamped& initial_pose);
  /// Of /tf_static and /tf: where the sensors are, and where tags were seen, which become scans.
  void handle(const tf2_msgs::TFMessage& transforms);

  /// Services. Those with a result return what they did in one line, or throw Error with nothing
  /// changed. What is saved is the filter as it is at the newest odometry; a loaded map is given
  /// out at once. After reset() all is as after construction, but for what was counted.
  void reset();
  std::string save_map(const std::string& path);
  std::string load_map(const std::string& path, bool frozen);
  /// Puts particles in place of the present ones, each with a map of those that are there.
  std::string set_particles(const geometry_msgs::PoseArray& poses,
                            const std::vector<double>& weights);

  /// Gives out map and path as they are at the newest odometry. For the end of a bag.
  void publish_results();

  /// All that is needed to go on as if nothing had happened, but for observations that wait;
  /// nothing while there is nothing to save. resume() goes on from there; it throws Error, with
  /// nothing changed, for a checkpoint that makes no sense or does not fit the options.
  std::optional<FastSlamCheckpoint> checkpoint();
  void resume(const FastSlamCheckpoint& checkpoint);

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

  const FastSlam& filter() const { return filter_; }
  const RejectCounter& rejects() const { return rejects_; }
  int queued() const { return static_cast<int>(scans_.size()); }
  /// Belief at the newest odometry; nothing before the first.
  std::optional<PoseEstimate> estimate() const;

 private:
  /// The last scan that was used, for the picture of what was taken as what.
  struct LatestScan {
    ros::Time stamp;
    Pose2 robot;
    Pose2 sensor;
    std::vector<RangeBearingObservation> observations;
    std::vector<ObservationOutcome> outcomes;
  };

  void start_about(const PoseEstimate& start, ros::Time stamp);
  void take_tag_scans();
  void process_ready();
  void drop_late();
  void update(const LandmarkObservationArray& scan);
  std::optional<Pose2> sensor_of(const std::string& frame);
  std::vector<RangeBearingObservation> usable_observations(const LandmarkObservationArray& scan);
  void recover(const LatestScan& scan);
  void take_new_belief();
  void note_outcomes(const LatestScan& scan, double duration);
  void note_scene(const LatestScan& scan);
  void note_scene_of_map();
  void carry_belief_forward();
  void forget_time(const DeadReckoning::Taken& jump = {});
  void start_filter_anew();
  void reject(const std::string& input, const Rejection& rejection);
  void log(LogLevel level, const std::string& text) const;

  void publish_pictures(ros::Time stamp);
  void publish_map(ros::Time stamp);
  void publish_path(ros::Time stamp);
  void publish_status(ros::Time stamp, double update_time);
  void publish_markers(ros::Time stamp);
  void publish_diagnostics(ros::Time stamp);

  FastSlamPipelineOptions options_;
  FastSlamSinks sinks_;
  std::string strategy_;
  std::string refused_;  // why parameters were refused last; empty once some were taken
  bool starts_frozen_;
  std::optional<SavedMap> start_map_;
  StaticFrames frames_;
  TagScans tags_;
  FastSlam filter_;
  DeadReckoning odometry_;
  std::deque<LandmarkObservationArray> scans_;  // in order of time
  std::vector<ros::Time> path_stamps_;          // of the filter's path
  PoseEstimate belief_;                         // of the particles

  RejectCounter rejects_;
  LatestScan latest_;
  std::vector<LandmarkEstimate> map_;  // the last that was given out
  std::set<std::int64_t> labels_;      // ids that have a marker
  LostDetector lost_;
  Eigen::AlignedBox2d scene_;  // where the robot has been and has seen landmarks
  RecentSightings sightings_;
  std::uint64_t injected_ = 0;  // particles, where a lost robot was found
  UpdateTiming timing_;
  double latency_ = 0.0;
  std::uint64_t reported_drops_ = 0;
  BeliefPublisher publisher_;
  std::uint64_t reported_rejects_ = 0;
  std::uint64_t reported_injected_ = 0;
  std::int64_t reported_weight_resets_ = 0;
  ros::Time last_scan_;
  ros::Time last_markers_, last_map_, last_diagnostics_;
};

}  // namespace pf_resampling
