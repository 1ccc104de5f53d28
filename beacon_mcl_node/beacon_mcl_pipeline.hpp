#pragma once

#include <pf_resampling/BeaconArray.h>
#include <pf_resampling/BeaconMap.h>
#include <pf_resampling/BeaconRange.h>
#include <sensor_msgs/Range.h>

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "beacon_mcl_node/beacon_markers.hpp"
#include "beacon_mcl_node/pipeline_options.hpp"
#include "beacon_mcl_node/range_sensor.hpp"
#include "pf_resampling_core/filters/beacon_mcl/beacon_mcl.hpp"
#include "src/checkpoint/checkpoint.hpp"
#include "src/pipeline/filter_pipeline.hpp"
#include "src/pipeline/inputs.hpp"

namespace pf_resampling {

struct BeaconMclTypes {
  using Filter = BeaconMcl;
  using Message = BeaconRange;
  using Observations = std::vector<RangeObservation>;
  using Options = BeaconMclPipelineOptions;
  using Checkpoint = BeaconMclCheckpoint;
  static constexpr ObservationNames kNames = kRangeNames;
  static const PresetList& presets() { return beacon_mcl_presets(); }
};
extern template class FilterPipeline<BeaconMclTypes>;

struct BeaconMclSinks : PipelineSinks {
  std::function<void(const BeaconMap&)> beacon_map;  ///< where beacons are found
  /// All ranges that are used.
  std::function<void(ros::Time, const std::vector<RangeObservation>&)> ranges;
};

/// Range-beacon localization from messages to messages. Ranges wait for the beacons too, and those
/// taken at the same time are one update.
class BeaconMclPipeline : public FilterPipeline<BeaconMclTypes> {
 public:
  using Sinks = BeaconMclSinks;

  /// Throws Error on options that make no sense.
  BeaconMclPipeline(const BeaconMclPipelineOptions& options, const BeaconMclSinks& sinks);

  using FilterPipeline::handle;
  /// A range whose frame_id names the beacon; on its way to handle(BeaconRange).
  void handle(const sensor_msgs::Range& range);
  /// The beacons, once. Other ones later start the filter anew; ignored if the options have
  /// beacons.
  void handle(const BeaconArray& beacons);

  /// What it takes, and on which topics.
  static constexpr auto inputs() {
    return std::make_tuple(
        Input<tf2_msgs::TFMessage>{{"/tf_static", "/tf"}}, Input<BeaconArray>{{"beacons"}},
        Input<geometry_msgs::PoseWithCovarianceStamped>{{"initialpose"}},
        Input<BeaconRange>{{"ranges"}}, Input<sensor_msgs::Range>{{"sensor_ranges"}},
        Input<sensor_msgs::Imu>{{"imu"}}, Input<nav_msgs::Odometry>{{"odom"}});
  }

  /// Service: starts anew from the ranges or over the area.
  void global_localization();

  /// Service: writes what was found to a file, which is a configuration; see beacon_file(). Returns
  /// what was written, or throws Error.
  std::string save_beacons(const std::string& path) const;

  std::vector<Finding> findings() const override;
  bool works_beside() const override { return filter_ && filter_->is_solving(); }

  /// Frame of the antenna of ranges that do not name one.
  const std::string& antenna() const { return names_.antenna; }

  /// Nothing while the beacons are not known and not to be found.
  const BeaconMcl* filter() const { return filter_.get(); }

 private:
  struct LatestRange {
    ros::Time stamp;
    double range = 0.0;
    double antenna_height = 0.0;
  };

  /// How a beacon does, as running means.
  struct BeaconHealth {
    double misfit_share = 0.0;  ///< of its ranges, beyond three sigma
    double period = 0.0;        ///< s between its ranges; 0 until there were two
    ros::Time last;

    bool is_silent(ros::Time now) const;
  };

  std::optional<Rejection> fault_in(const BeaconRange& range) const override;
  std::optional<double> simultaneous() const override { return options_.simultaneous; }
  std::optional<Observations> to_observations(const std::vector<BeaconRange>& group) override;
  void update_filter(const OdometryIncrement& odometry, const Observations& used) override;
  void note_observations(ros::Time stamp, const Observations& used, double duration) override;
  void forget_observations() override;

  std::optional<PoseEstimate> belief_of_filter() override;
  void put_robot(const PoseEstimate& there) override;
  OdometryIncrement motion_since_update() const override;
  double extent(const PoseEstimate& belief) const override;
  void save_filter(BeaconMclCheckpoint* checkpoint) override;
  void load_filter(const BeaconMclCheckpoint& checkpoint) override;

  bool finds_beacons() const {
    return options_.filter.beacon_positions == BeaconPositions::estimated;
  }
  std::vector<PlacedBeacon> places() const;
  void publish_map_if_due(ros::Time stamp) override;
  visualization_msgs::MarkerArray markers(ros::Time stamp) override;
  void fill_in(FilterStatus* status) const override;
  void note_findings(ros::Time stamp);
  void note_odometry_scales(ros::Time stamp, const RangeMemory& memory);
  std::string waits_for() const override;
  void add_health(HealthInputs* inputs) const override;
  void diagnose(diagnostic_msgs::DiagnosticStatus* /*status*/) override {}
  void add_diagnostics(ros::Time stamp, diagnostic_msgs::DiagnosticArray* array) override;

  std::unique_ptr<BeaconMcl> make_filter(const std::vector<Beacon>& beacons);
  std::optional<Rejection> check_beacon(int id) const;
  std::optional<RangeObservation> to_observation(const BeaconRange& range);
  void note_health(ros::Time stamp, int beacon, double squared_innovation);
  double usual_misfit_share() const;
  bool does_not_fit(const BeaconHealth& health) const;

  const BeaconNames names_;
  ScalarEstimate yaw_rate_bias_;  // of the belief
  std::map<int, LatestRange> latest_ranges_;
  std::map<int, BeaconHealth> beacon_health_;
  std::map<int, Finding> findings_;  // by beacon
  std::vector<Finding> odometry_findings_;
  const BeaconMclSinks own_sinks_;
  ros::Time last_map_;
  ros::Time last_beacons_;  // that were drawn
};

using BeaconMclMessage = AnyMessage<BeaconMclPipeline>;

}  // namespace pf_resampling
