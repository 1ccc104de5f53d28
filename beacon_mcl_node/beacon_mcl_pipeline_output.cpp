// The messages that BeaconMclPipeline gives out.
#include <cmath>

#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"
#include "src/diagnostics/diagnostics.hpp"
#include "src/pictures/markers.hpp"

namespace pf_resampling {
namespace {

// Beacons stand still: their markers are repeated for viewers that come late.
constexpr double kBeaconMarkerPeriod = 5.0;  // s
// Above this probability of being lost there is a warning.
constexpr double kLostWarning = 0.5;
// A running mean of squared innovations over their expected variance, 1 for a good beacon, that
// says that its ranges do not fit.
constexpr double kMisfitLimit = 6.0;
// A beacon is silent after so long, and so many of its usual periods.
constexpr double kBeaconSilence = 5.0;  // s
constexpr double kSilentPeriods = 8.0;

}  // namespace

// What is for looking at, at rates of its own.
void BeaconMclPipeline::publish_pictures(ros::Time stamp) {
  if (publisher_.wants_clouds() && belief_) {
    const BeaconMclParticles& particles = filter_->particles();
    const Pose2 motion = moved_by({}, odometry_.since(), yaw_rate_bias_.mean).mean;
    publisher_.publish_clouds(
        stamp, {particles.x, particles.y, particles.heading, particles.weight, particles.ancestor},
        motion);
  }
  if (sinks_.markers && filter_ && is_due(options_.output.marker_period, stamp, &last_markers_)) {
    publish_markers(stamp);
  }
  publisher_.publish_path(stamp);
  if (sinks_.diagnostics && is_due(options_.output.diagnostics_period, stamp, &last_diagnostics_)) {
    publish_diagnostics(stamp);
  }
}

void BeaconMclPipeline::publish_markers(ros::Time stamp) {
  const MarkerFrame frame = {options_.frames.map, stamp};
  const std::vector<Beacon>& beacons = filter_->beacons();
  const double extent = extent_of(beacons);
  const double line = 0.002 * extent;
  visualization_msgs::MarkerArray markers;
  const auto take = [&](const visualization_msgs::MarkerArray& array) {
    markers.markers.insert(markers.markers.end(), array.markers.begin(), array.markers.end());
  };
  if (is_due(kBeaconMarkerPeriod, stamp, &last_beacons_)) {
    take(beacon_markers(frame, beacons, 0.025 * extent));
  }
  for (std::size_t i = 0; i < beacons.size(); ++i) {
    const auto latest = latest_ranges_.find(beacons[i].id);
    if (latest == latest_ranges_.end()) continue;
    const double age = (stamp - latest->second.stamp).toSec();
    if (age > options_.ring_lifetime) continue;
    const double distance = filter_->corrected_range(beacons[i].id, latest->second.range);
    markers.markers.push_back(range_ring_marker(frame, beacons[i], static_cast<int>(i), distance,
                                                latest->second.antenna_height,
                                                options_.ring_lifetime - age, line));
  }
  if (const auto belief = estimate()) {
    take(pose_ellipse_markers(frame, *belief, 1.5 * line));
  }
  publisher_.publish_markers(markers);
}

void BeaconMclPipeline::publish_status(ros::Time stamp, double update_time) {
  if (!sinks_.status) return;
  const BeaconMclStatus& filter = filter_->status();
  FilterStatus message = to_message(filter);
  message.header.stamp = stamp;
  message.header.frame_id = options_.frames.map;
  message.strategy = strategy_;
  message.refused = refused_;
  message.injected = static_cast<std::uint64_t>(filter.injected);
  message.observation = filter.observation;
  message.innovation = filter.innovation;
  message.innovation_sigma = filter.innovation_sigma;
  message.update_time = update_time;
  message.latency = latency_;
  message.lost = lost_probability();
  message.normalized_innovation = lost_.normalized_innovation();
  message.queued = static_cast<std::uint32_t>(ranges_.size());
  message.rejects = to_messages(rejects_);
  for (const CalibrationEstimate& estimate : filter_->calibration()) {
    CalibrationStatus radio;
    radio.beacon = estimate.beacon;
    radio.scale = estimate.scale;
    radio.scale_sigma = estimate.scale_sigma;
    radio.bias = estimate.bias;
    radio.bias_sigma = estimate.bias_sigma;
    message.calibration.push_back(radio);
  }
  message.yaw_rate_bias = yaw_rate_bias_.mean;
  message.yaw_rate_bias_sigma = yaw_rate_bias_.sigma;
  publisher_.publish_status(message);
}

void BeaconMclPipeline::publish_diagnostics(ros::Time stamp) {
  using diagnostic_msgs::DiagnosticStatus;
  diagnostic_msgs::DiagnosticArray array;
  array.header.stamp = stamp;

  DiagnosticStatus localization = make_diagnostic(options_.name + ": localization");
  const std::optional<PoseEstimate> belief = estimate();
  if (!filter_) {
    worsen(DiagnosticStatus::WARN, "waiting for the beacons", &localization);
  } else if (!belief) {
    worsen(DiagnosticStatus::WARN, "waiting for ranges to start from", &localization);
  } else {
    const double sigma = position_sigma(*belief);
    if (!std::isfinite(sigma)) {
      worsen(DiagnosticStatus::ERROR, "the belief is not finite", &localization);
    }
    if (lost_.probability() > kLostWarning) {
      worsen(DiagnosticStatus::WARN, "the ranges do not fit the belief: lost?", &localization);
    } else if (lost_probability() > kLostWarning) {
      worsen(DiagnosticStatus::WARN, "position not known yet", &localization);
    }
    const BeaconMclStatus& status = filter_->status();
    if (status.weight_resets > reported_weight_resets_) {
      worsen(DiagnosticStatus::ERROR, "all weights vanished and were reset", &localization);
    }
    reported_weight_resets_ = status.weight_resets;
    add_value("position sigma [m]", number_text(sigma), &localization);
    add_value("lost (probability)", number_text(lost_probability()), &localization);
    add_value("normalized innovation (1 expected)", number_text(lost_.normalized_innovation()),
              &localization);
    add_value("particles", std::to_string(status.particles), &localization);
    add_value("effective sample size", number_text(status.effective_sample_size), &localization);
    add_value("updates", std::to_string(status.updates), &localization);
    add_value("renewals", std::to_string(status.renewals), &localization);
    add_value("injected particles", std::to_string(status.injected), &localization);
    add_value("weight resets", std::to_string(status.weight_resets), &localization);
    add_value("strategy", strategy_, &localization);
  }
  if (publisher_.held_back() > 0) {
    worsen(DiagnosticStatus::ERROR, "messages with NaN or infinity were held back", &localization);
    add_value("messages held back", std::to_string(publisher_.held_back()), &localization);
  }
  if (localization.message.empty()) localization.message = "localized";
  array.status.push_back(localization);

  array.status.push_back(inputs_diagnostic(options_.name + ": inputs", stamp, odometry_, "ranges",
                                           last_range_, ranges_.size(), rejects_,
                                           &reported_rejects_));
  array.status.push_back(beacons_diagnostic(stamp));
  array.status.push_back(timing_diagnostic(options_.name + ": timing", timing_, latency_, rejects_,
                                           "ranges", &reported_drops_));
  if (sinks_.more_diagnostics) sinks_.more_diagnostics(&array);
  sinks_.diagnostics(array);
}

// One that fails shows beside the others; when all do not fit, it is the belief that is wrong.
diagnostic_msgs::DiagnosticStatus BeaconMclPipeline::beacons_diagnostic(ros::Time stamp) const {
  using diagnostic_msgs::DiagnosticStatus;
  DiagnosticStatus status = make_diagnostic(options_.name + ": beacons");
  const bool is_lost = lost_.probability() > kLostWarning;
  for (const auto& [id, health] : beacon_health_) {
    const std::string beacon = "beacon " + std::to_string(id);
    const double silence = (stamp - health.last).toSec();
    const bool others_are_heard = (stamp - last_range_).toSec() < kBeaconSilence;
    if (others_are_heard && health.period > 0.0 &&
        silence > kBeaconSilence + kSilentPeriods * health.period) {
      worsen(DiagnosticStatus::WARN,
             beacon + " has not been heard for " + number_text(silence) + " s", &status);
    }
    if (!is_lost && health.normalized_innovation > kMisfitLimit) {
      worsen(DiagnosticStatus::WARN,
             "the ranges of " + beacon + " do not fit: moved, reflected, or lying?", &status);
    }
    add_value(beacon + ": normalized innovation (1 expected)",
              number_text(health.normalized_innovation), &status);
    add_value(beacon + ": last range [s ago]", number_text(silence), &status);
  }
  if (status.message.empty()) status.message = "fine";
  return status;
}

void BeaconMclPipeline::report_silence(ros::Time now) {
  if (sinks_.diagnostics && is_due(options_.output.diagnostics_period, now, &last_diagnostics_)) {
    publish_diagnostics(now);
  }
}

}  // namespace pf_resampling
