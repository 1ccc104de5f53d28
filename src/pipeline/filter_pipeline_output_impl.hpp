#pragma once

// What FilterPipeline gives out; part of filter_pipeline_impl.hpp.

#include <algorithm>
#include <cmath>

#include "src/messages/conversions.hpp"
#include "src/odometry/input_checks.hpp"
#include "src/pictures/markers.hpp"
#include "src/pipeline/filter_pipeline.hpp"

namespace pf_resampling {

// s from one status to the next while there are no updates.
inline constexpr double kStatusPeriod = 1.0;

// ---- messages out -----------------------------------------------------------------------------

// What is for looking at, at rates of its own.
template <typename Types>
void FilterPipeline<Types>::publish_pictures(ros::Time stamp) {
  if (publisher_.wants_clouds() && belief_) {
    const auto& particles = filter_->particles();
    publisher_.publish_clouds(
        stamp, {particles.x, particles.y, particles.heading, particles.weight, particles.ancestor},
        motion_since_update().mean);
  }
  publish_map_if_due(stamp);
  if (sinks_.markers && filter_ && is_due(options_.output.marker_period, stamp, &last_markers_)) {
    visualization_msgs::MarkerArray array = markers(stamp);
    add_places(stamp, &array);
    sinks_.markers(array);
  }
  publish_path(stamp);
  report_silence(stamp);
}

template <typename Types>
PoseClusters FilterPipeline<Types>::places_now() const {
  PoseClusters now = places_;
  if (now.clusters.empty()) return now;
  const Pose2 motion = motion_since_update().mean;
  for (PoseCluster& place : now.clusters) place.pose.mean = compose(place.pose.mean, motion);
  return now;
}

template <typename Types>
void FilterPipeline<Types>::add_places(ros::Time stamp, visualization_msgs::MarkerArray* markers) {
  const std::optional<PoseEstimate> belief = estimate();
  if (!belief) return;
  const PoseClusters now = places_now();
  const double size = extent(*belief);
  const double height = std::clamp(0.025 * size, 0.1, 5.0);
  const MarkerFrame frame = {options_.frames.map, stamp};
  const double line = std::clamp(0.003 * size, 0.01, 0.4);
  append(hypothesis_markers(frame, now, line, height, &shown_places_), markers);
  const double shown = 2.0 * options_.output.marker_period;
  append(finding_markers(frame, findings_in_words(), 1.4 * height, shown), markers);
}

template <typename Types>
void FilterPipeline<Types>::publish_status(ros::Time stamp) {
  if (!sinks_.status) return;
  last_status_ = stamp;
  FilterStatus message = filter_ ? to_message(filter_->status()) : FilterStatus();
  message.header.stamp = stamp;
  message.header.frame_id = options_.frames.map;
  message.strategy = strategy_;
  message.refused = refused_;
  message.update_time = update_time_;
  message.latency = latency_;
  const HealthJudgement judgement = health();
  message.health = to_string(judgement.health);
  const std::string places = sentence_of(places_);
  message.health_text = sentence_of(judgement);
  if (!places.empty()) {
    message.health_text += (message.health_text.back() == '.' ? " " : ". ") + places + ".";
  }
  message.findings = findings_in_words();
  message.hypotheses = to_hypotheses(stamp > last_observation_ ? places_now() : places_);
  message.other_weight = places_.rest;
  message.lost = lost_probability();
  message.normalized_innovation = lost_.normalized_innovation();
  message.queued = static_cast<std::uint32_t>(waiting_.size());
  message.rejects = to_messages(rejects_);
  if (filter_) fill_in(&message);
  sinks_.status(message);
}

template <typename Types>
void FilterPipeline<Types>::report_silence(ros::Time now) {
  if (const auto rejection = check(now)) return reject("clock", *rejection);
  if (last_status_.isZero()) last_status_ = now;
  if (std::abs(now.toSec() - last_status_.toSec()) >= kStatusPeriod) publish_status(now);
  if (sinks_.diagnostics && is_due(options_.output.diagnostics_period, now, &last_diagnostics_)) {
    publish_diagnostics(now);
  }
}

template <typename Types>
void FilterPipeline<Types>::publish_diagnostics(ros::Time stamp) {
  diagnostic_msgs::DiagnosticArray array;
  array.header.stamp = stamp;
  array.status.push_back(belief_diagnostic());
  array.status.push_back(inputs_diagnostic(options_.name + ": inputs", stamp, odometry_,
                                           Types::kNames.topic, last_observation_, waiting_.size(),
                                           rejects_, &reported_rejects_));
  array.status.push_back(timing_diagnostic(options_.name + ": timing", timing_, latency_, rejects_,
                                           Types::kNames.topic, &reported_drops_));
  add_diagnostics(stamp, &array);
  if (sinks_.more_diagnostics) sinks_.more_diagnostics(&array);
  sinks_.diagnostics(array);
}

template <typename Types>
diagnostic_msgs::DiagnosticStatus FilterPipeline<Types>::belief_diagnostic() {
  using diagnostic_msgs::DiagnosticStatus;
  DiagnosticStatus entry = make_diagnostic(options_.name + ": " + Types::kNames.task);
  const HealthJudgement judgement = health();
  // The entry on timing says what is too slow.
  if (judgement.health != Health::healthy && judgement.health != Health::too_slow) {
    worsen(DiagnosticStatus::WARN, judgement.reason, &entry);
  }
  add_value("health", to_string(judgement.health), &entry);
  add_value("what to do about it", judgement.remedy, &entry);
  if (const auto belief = estimate()) {
    const double sigma = position_sigma(*belief);
    if (!std::isfinite(sigma))
      worsen(DiagnosticStatus::ERROR, "the estimate is not finite", &entry);
    add_value("position sigma [m]", number_text(sigma), &entry);
    add_value("heading sigma [rad]", number_text(heading_sigma(*belief)), &entry);
    add_value("lost (probability)", number_text(lost_probability()), &entry);
    add_value("normalized innovation (1 expected)", number_text(lost_.normalized_innovation()),
              &entry);
    const std::string places = sentence_of(places_);
    add_value("places that fit", places.empty() ? "one, or none" : places, &entry);
  }
  if (filter_) {
    const auto& status = filter_->status();
    if (status.weight_resets > reported_weight_resets_) {
      worsen(DiagnosticStatus::ERROR, "all weights vanished and were reset", &entry);
    }
    reported_weight_resets_ = status.weight_resets;
    add_value("particles", std::to_string(status.particles), &entry);
    add_value("effective sample size", number_text(status.effective_sample_size), &entry);
    add_value("distinct ancestors, of the last renewal",
              std::to_string(status.distinct_ancestors_of_renewal), &entry);
    add_value("distinct ancestors, since the start",
              std::to_string(status.distinct_ancestors_since_start), &entry);
    add_value("updates", std::to_string(status.updates), &entry);
    add_value("renewals", std::to_string(status.renewals), &entry);
    add_value("injected particles", std::to_string(status.injected), &entry);
    add_value("weight resets", std::to_string(status.weight_resets), &entry);
    add_value("strategy", strategy_, &entry);
    diagnose(&entry);
  }
  const std::vector<FindingStatus> found = findings_in_words();
  std::string list;
  for (std::size_t i = 0; i < found.size(); ++i) {
    list += (list.empty() ? "" : "; ") + found[i].text;
    if (i >= reported_findings_) worsen(DiagnosticStatus::WARN, found[i].text, &entry);
  }
  reported_findings_ = found.size();
  add_value("findings", found.empty() ? "none" : list, &entry);
  if (publisher_.held_back() > 0) {
    worsen(DiagnosticStatus::ERROR, "poses with NaN or infinity were not published", &entry);
  }
  add_value("poses not published", std::to_string(publisher_.held_back()), &entry);
  if (entry.message.empty()) entry.message = "fine";
  return entry;
}

}  // namespace pf_resampling
