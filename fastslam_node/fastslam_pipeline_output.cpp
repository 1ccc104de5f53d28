// The messages that FastSlamPipeline gives out.
#include <algorithm>
#include <cmath>

#include "fastslam_node/fastslam_pipeline.hpp"
#include "fastslam_node/landmark_markers.hpp"
#include "src/diagnostics/diagnostics.hpp"
#include "src/pictures/markers.hpp"

namespace pf_resampling {
namespace {

// Above this probability of being lost there is a warning.
constexpr double kLostWarning = 0.5;
// Weights add up to one but for this.
constexpr double kRounding = 1e-9;
// How long, s, a scan is shown at least.
constexpr double kScanShown = 1.0;

}  // namespace

// What is for looking at, at rates of its own.
void FastSlamPipeline::publish_pictures(ros::Time stamp) {
  if (publisher_.wants_clouds()) {
    const FastSlamParticles& particles = filter_.particles();
    publisher_.publish_clouds(
        stamp, {particles.x, particles.y, particles.heading, particles.weight, particles.ancestor},
        filter_.corrected(odometry_.since()).mean);
  }
  if ((sinks_.landmark_map || sinks_.markers) && is_due(options_.map_period, stamp, &last_map_)) {
    publish_map(stamp);
  }
  if (sinks_.markers && is_due(options_.output.marker_period, stamp, &last_markers_)) {
    publish_markers(stamp);
  }
  publish_path(stamp);
  if (sinks_.diagnostics && is_due(options_.output.diagnostics_period, stamp, &last_diagnostics_)) {
    publish_diagnostics(stamp);
  }
}

void FastSlamPipeline::publish_results() {
  if (odometry_.empty()) return;
  publish_map(odometry_.newest());
  publisher_.hurry_path();
  publish_path(odometry_.newest());
}

void FastSlamPipeline::publish_map(ros::Time stamp) {
  map_.clear();
  for (const LandmarkEstimate& landmark : filter_.map()) {
    if (!landmark.mean.allFinite() || !landmark.covariance.allFinite()) {
      publisher_.hold_back();
    } else if (landmark.held >= options_.map_min_held - kRounding) {
      map_.push_back(landmark);
    }
  }
  if (!sinks_.landmark_map) return;
  LandmarkMap message;
  message.header.stamp = stamp;
  message.header.frame_id = options_.frames.map;
  for (const LandmarkEstimate& estimate : map_) {
    Landmark landmark;
    landmark.id = static_cast<std::int32_t>(estimate.id);
    landmark.position.x = estimate.mean.x();
    landmark.position.y = estimate.mean.y();
    landmark.covariance = {estimate.covariance(0, 0), estimate.covariance(0, 1),
                           estimate.covariance(1, 0), estimate.covariance(1, 1)};
    message.landmarks.push_back(landmark);
  }
  sinks_.landmark_map(message);
}

// The whole path as it is believed now: what came later corrects what was driven before.
void FastSlamPipeline::publish_path(ros::Time stamp) {
  publisher_.publish_path(stamp, path_stamps_, [this] { return filter_.path(); });
}

void FastSlamPipeline::publish_markers(ros::Time stamp) {
  const std::optional<PoseEstimate> belief = estimate();
  if (!belief) return;
  const MarkerFrame frame = {options_.frames.map, stamp};
  const double extent = extent_of(map_);
  const double line = std::clamp(0.0015 * extent, 0.01, 0.2);
  visualization_msgs::MarkerArray markers = landmark_markers(frame, map_, line);
  const auto take = [&](const visualization_msgs::MarkerArray& array) {
    markers.markers.insert(markers.markers.end(), array.markers.begin(), array.markers.end());
  };
  const double height =
      options_.label_height > 0.0 ? options_.label_height : std::clamp(0.018 * extent, 0.1, 3.0);
  take(label_markers(frame, map_, height, &labels_));
  ScanPicture scan;
  const double shown = std::max(kScanShown, 2.0 * options_.output.marker_period);
  if ((stamp - latest_.stamp).toSec() <= shown) {
    scan = {latest_.robot, latest_.sensor, latest_.observations, latest_.outcomes};
  }
  take(association_markers(frame, scan, map_, line, shown));
  take(pose_ellipse_markers(frame, *belief, 2.0 * line));
  publisher_.publish_markers(markers);
}

void FastSlamPipeline::publish_status(ros::Time stamp, double update_time) {
  if (!sinks_.status) return;
  const FastSlamStatus& filter = filter_.status();
  FilterStatus message = to_message(filter);
  message.header.stamp = stamp;
  message.header.frame_id = options_.frames.map;
  message.strategy = strategy_;
  message.refused = refused_;
  message.landmarks = static_cast<std::uint32_t>(filter.landmarks);
  message.injected = injected_;
  message.observation = -1;
  message.update_time = update_time;
  message.latency = latency_;
  message.lost = lost_probability();
  message.normalized_innovation = lost_.normalized_innovation();
  message.queued = static_cast<std::uint32_t>(scans_.size());
  message.rejects = to_messages(rejects_);
  publisher_.publish_status(message);
}

void FastSlamPipeline::publish_diagnostics(ros::Time stamp) {
  using diagnostic_msgs::DiagnosticStatus;
  diagnostic_msgs::DiagnosticArray array;
  array.header.stamp = stamp;
  DiagnosticStatus mapping = make_diagnostic(options_.name + ": mapping");
  const FastSlamStatus& status = filter_.status();
  const std::optional<PoseEstimate> belief = estimate();
  const double sigma = belief ? position_sigma(*belief) : 0.0;
  if (!std::isfinite(sigma)) {
    worsen(DiagnosticStatus::ERROR, "the belief is not finite", &mapping);
  }
  if (status.landmarks == 0) {
    worsen(DiagnosticStatus::WARN, "no landmark has been seen yet", &mapping);
  }
  if (lost_.probability() > kLostWarning) {
    worsen(DiagnosticStatus::WARN, "the observations do not fit the map: lost?", &mapping);
  } else if (lost_probability() > kLostWarning) {
    worsen(DiagnosticStatus::WARN, "the position is uncertain by a good part of the map", &mapping);
  }
  if (injected_ > reported_injected_) {
    worsen(DiagnosticStatus::WARN, "was lost: the robot was put where the landmarks seen fit",
           &mapping);
  }
  reported_injected_ = injected_;
  if (status.weight_resets > reported_weight_resets_) {
    worsen(DiagnosticStatus::ERROR, "all weights vanished and were reset", &mapping);
  }
  reported_weight_resets_ = status.weight_resets;
  if (publisher_.held_back() > 0) {
    worsen(DiagnosticStatus::ERROR, "messages with NaN or infinity were held back", &mapping);
  }
  if (mapping.message.empty()) mapping.message = "fine";
  add_value("position sigma [m]", number_text(sigma), &mapping);
  add_value("lost (probability)", number_text(lost_probability()), &mapping);
  add_value("normalized innovation (1 expected)", number_text(lost_.normalized_innovation()),
            &mapping);
  add_value("landmarks", std::to_string(status.landmarks), &mapping);
  add_value("particles", std::to_string(status.particles), &mapping);
  add_value("effective sample size", number_text(status.effective_sample_size), &mapping);
  add_value("distinct ancestors", std::to_string(status.distinct_ancestors), &mapping);
  add_value("updates", std::to_string(status.updates), &mapping);
  add_value("renewals", std::to_string(status.renewals), &mapping);
  add_value("weight resets", std::to_string(status.weight_resets), &mapping);
  add_value("injected particles", std::to_string(injected_), &mapping);
  add_value("data association", to_string(filter_.association()), &mapping);
  add_value("strategy", strategy_, &mapping);
  add_value("messages held back", std::to_string(publisher_.held_back()), &mapping);
  array.status.push_back(mapping);
  array.status.push_back(inputs_diagnostic(options_.name + ": inputs", stamp, odometry_,
                                           "landmarks", last_scan_, scans_.size(), rejects_,
                                           &reported_rejects_));
  array.status.push_back(timing_diagnostic(options_.name + ": timing", timing_, latency_, rejects_,
                                           "landmarks", &reported_drops_));
  if (sinks_.more_diagnostics) sinks_.more_diagnostics(&array);
  sinks_.diagnostics(array);
}

void FastSlamPipeline::report_silence(ros::Time now) {
  if (sinks_.diagnostics && is_due(options_.output.diagnostics_period, now, &last_diagnostics_)) {
    publish_diagnostics(now);
  }
}

}  // namespace pf_resampling
