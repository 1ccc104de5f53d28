#pragma once

#include <pf_resampling/LandmarkMap.h>
#include <pf_resampling/LandmarkObservationArray.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "fastslam_node/landmark_markers.hpp"
#include "fastslam_node/pipeline_options.hpp"
#include "fastslam_node/tag_scans.hpp"
#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "pf_resampling_core/filters/fastslam/global_search.hpp"
#include "pf_resampling_core/filters/fastslam/landmark_changes.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"
#include "src/checkpoint/checkpoint.hpp"
#include "src/pipeline/filter_pipeline.hpp"
#include "src/pipeline/inputs.hpp"

namespace pf_resampling {

/// What a sensor sees at once.
struct LandmarkScan {
  Pose2 sensor;  ///< on the robot
  std::vector<RangeBearingObservation> observations;
};

struct FastSlamTypes {
  using Filter = FastSlam;
  using Message = LandmarkObservationArray;
  using Observations = LandmarkScan;
  using Options = FastSlamPipelineOptions;
  using Checkpoint = FastSlamCheckpoint;
  static constexpr ObservationNames kNames = kScanNames;
  static const PresetList& presets() { return fastslam_presets(); }
};
extern template class FilterPipeline<FastSlamTypes>;

/// Where the messages of the pipeline go. What is empty is not made at all.
struct FastSlamSinks : PipelineSinks {
  std::function<void(const LandmarkMap&)> landmark_map;
  /// The whole path as it is believed at the end: stamps, and as many poses.
  std::function<void(const std::vector<ros::Time>&, const std::vector<Pose2>&)> final_path;
  /// Every scan that is used.
  std::function<void(const LandmarkScan&)> scan;
  /// After every update, at the stamp of its scan: for evaluation of the particles and their maps.
  std::function<void(ros::Time, FastSlam*)> updated;
};

/// FastSLAM from messages to messages. The map frame is where the robot was at the first odometry,
/// unless an initial pose or a loaded map say otherwise.
class FastSlamPipeline : public FilterPipeline<FastSlamTypes> {
 public:
  using Sinks = FastSlamSinks;

  /// Throws Error on options that make no sense, or a map file that cannot be used. A node starts
  /// without that map instead (options.starts_without_map) and says so.
  FastSlamPipeline(const FastSlamPipelineOptions& options, const FastSlamSinks& sinks);

  /// What it takes, and on which topics, in the order in which messages of the same time in a bag
  /// are taken. Transforms may also be of tags that were seen: they become scans.
  static constexpr auto inputs() {
    return std::make_tuple(Input<tf2_msgs::TFMessage>{{"/tf_static", "/tf"}},
                           Input<geometry_msgs::PoseWithCovarianceStamped>{{"initialpose"}},
                           Input<LandmarkObservationArray>{{"landmarks"}},
                           Input<sensor_msgs::Imu>{{"imu"}}, Input<nav_msgs::Odometry>{{"odom"}});
  }

  /// Services. They return what they did in one line, or throw Error with nothing changed. What is
  /// saved is the filter as it is at the newest odometry; a loaded map is given out at once.
  std::string save_map(const std::string& path);
  std::string load_map(const std::string& path, bool frozen);

  /// Service: looks for the robot everywhere in the map, by all that it sees in the next seconds,
  /// with ids or without. Until it is found, the filter follows odometry alone, spread over the
  /// map.
  void global_localization();

  void set_parameters(const std::map<std::string, std::string>& values);

  /// How many landmarks save_map() would write.
  std::size_t landmarks() { return saved_map(filter_.get(), 0).landmarks.size(); }

  /// How many observations of known landmarks were too far off to be believed.
  std::uint64_t not_believed() const { return not_believed_; }

  /// Gives out map and path as they are at the newest odometry; where the renewal is redraw, of a
  /// copy that is redrawn once more: the filter stays as it is. For the end of a bag.
  void publish_results();

  std::vector<Finding> findings() const override { return findings_; }

  const FastSlam& filter() const { return *filter_; }

 private:
  std::optional<Rejection> fault_in(const LandmarkObservationArray& scan) const override;
  bool take_transform(const geometry_msgs::TransformStamped& transform) override;
  void hand_over_observations() override;
  std::optional<LandmarkScan> to_observations(
      const std::vector<LandmarkObservationArray>& group) override;
  void update_filter(const OdometryIncrement& odometry, const LandmarkScan& used) override;
  void note_step(ros::Time stamp) override { path_stamps_.push_back(stamp); }
  void note_observations(ros::Time stamp, const LandmarkScan& used, double duration) override;
  void forget_observations() override;
  void forget_past() override;

  void put_robot(const PoseEstimate& there) override {
    filter_->set_poses(there);
    predictions_.clear();
  }
  void restart_filter() override;
  OdometryIncrement motion_since_update() const override;
  double extent(const PoseEstimate& belief) const override;
  PoseEstimate place() const override { return filter_->place(); }
  // By three standard errors, of which a redraw's draws hold one.
  double noise_doubt() const override { return std::pow(filter_->noise_doubt(), 2.0 / 3.0); }
  void save_filter(FastSlamCheckpoint* checkpoint) override;
  void load_filter(const FastSlamCheckpoint& checkpoint) override;

  void publish_map_if_due(ros::Time stamp) override;
  void publish_path(ros::Time stamp) override;
  visualization_msgs::MarkerArray markers(ros::Time stamp) override;
  void fill_in(FilterStatus* status) const override;
  std::string waits_for() const override { return "odometry"; }
  void add_health(HealthInputs* inputs) const override;
  void diagnose(diagnostic_msgs::DiagnosticStatus* status) override;

  std::optional<Pose2> sensor_of(const std::string& frame);
  void note_id_at_two_places(const std::string& which);
  std::vector<RangeBearingObservation> usable_observations(const LandmarkObservationArray& scan);
  void spread_over_map();
  void search(ros::Time stamp, const LandmarkScan& scan);
  void note_adrift(const ScanPicture& scan);
  void note_outcomes(const ScanPicture& scan, double duration);
  void note_findings(ros::Time stamp, const ScanPicture& scan);
  void note_slips(ros::Time stamp);
  void note_odometry_scale(ros::Time stamp);
  void withdraw(const std::function<bool(const Finding&)>& is_withdrawn);
  void note_jump(ros::Time stamp, const ScanPicture& scan, double least);
  void note_wrong_belief();
  void note_empty_scan(ros::Time stamp, const Pose2& sensor);
  void note_changes(ros::Time stamp, const ScanPicture& scan);
  void note_finding(const Finding& finding);
  bool watches_landmarks() const;
  void note_scene(const ScanPicture& scan);
  void note_given_map();
  bool can_redraw() const;
  void recover(ros::Time stamp, const LandmarkScan& scan);
  void publish_map(ros::Time stamp);
  void publish_map_and_path();

  const FastSlamSinks own_sinks_;
  bool starts_frozen_;
  std::uint64_t ids_at_two_places_ = 0;  // scans
  std::string last_id_at_two_places_;
  std::optional<SavedMap> start_map_;
  std::optional<GlobalSearch> search_;  // while it is not known where in the map the robot is
  bool begins_search_ = false;          // with the next belief
  std::string loaded_map_;              // its file; empty: the filter has a map of its own
  std::string start_problem_;  // why there is none although one was given; until one is loaded
  TagScans tags_;
  std::vector<ros::Time> path_stamps_;                       // of the filter's path
  std::optional<std::pair<ros::Time, ScanPicture>> latest_;  // that was used, for the markers
  bool search_is_ambiguous_ = false;                         // and that was said
  std::vector<LandmarkEstimate> map_;                        // the last that was given out
  std::set<std::int64_t> labels_;                            // ids that have a marker
  Eigen::AlignedBox2d scene_;  // where the robot has been and has seen landmarks
  std::int64_t reported_injected_ = 0;
  struct Prediction {
    ros::Time since;
    PoseEstimate pose;
  };
  std::deque<Prediction> predictions_;  // by beliefs of the last seconds and odometry
  LandmarkChanges changes_;
  bool belief_was_wrong_ = false;       // since the last redraw that changes_ took
  std::deque<MapScan> doubtful_scans_;  // that contradict the odometry: changes_ has to wait
  std::optional<double> given_;  // s since the start of the memory: in a loaded map, until when ...
  bool is_found_ = false;        // ... the robot was sought there
  std::vector<Finding> findings_;  // in order of discovery
  std::int64_t redraws_searched_ = 0;
  std::uint64_t not_believed_ = 0;  // observations, since the start
  std::string last_not_believed_;   // in words
  int doubts_ = 0;                  // of the last observations, all of one landmark, ...
  std::int64_t doubted_id_ = -1;    // ... this one, that were not believed
  // Landmarks started since one of before was seen where it is: that they are seen where they were
  // started does not say that the robot is where it believes.
  std::set<std::int64_t> adrift_;
  ros::Time last_map_;
};

using FastSlamMessage = AnyMessage<FastSlamPipeline>;

}  // namespace pf_resampling
