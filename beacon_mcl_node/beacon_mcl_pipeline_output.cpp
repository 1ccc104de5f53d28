// The messages that BeaconMclPipeline gives out.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"
#include "pf_resampling/conversions.hpp"
#include "pf_resampling/markers.hpp"

namespace pf_resampling {
namespace {

// Beacons stand still: their markers are repeated for viewers that come late.
constexpr double kBeaconMarkerPeriod = 5.0;  // s
// Squared innovations over their expected variance are 1 on average; this says that the ranges do
// not fit the belief.
constexpr double kMisfitLimit = 6.0;
// Without ranges for so long, dead reckoning is all there is.
constexpr double kRangeSilence = 5.0;  // s
// Share of the extent of the beacons above which the position counts as not known.
constexpr double kUnknownPosition = 0.1;

bool is_finite(const PoseEstimate& estimate) {
  return is_finite(estimate.mean) && estimate.covariance.allFinite();
}

bool is_finite(const FilterStatus& status) {
  bool finite = std::isfinite(status.effective_sample_size) &&
                std::isfinite(status.entropy_sample_size) && std::isfinite(status.log_likelihood) &&
                std::isfinite(status.innovation) && std::isfinite(status.innovation_sigma) &&
                std::isfinite(status.yaw_rate_bias) && std::isfinite(status.yaw_rate_bias_sigma);
  for (const CalibrationStatus& radio : status.calibration) {
    finite = finite && std::isfinite(radio.scale) && std::isfinite(radio.scale_sigma) &&
             std::isfinite(radio.bias) && std::isfinite(radio.bias_sigma);
  }
  return finite;
}

double position_sigma(const PoseEstimate& estimate) {
  return std::sqrt(std::max(0.0, estimate.covariance(0, 0) + estimate.covariance(1, 1)));
}

std::string number_text(double value) {
  char text[40];
  std::snprintf(text, sizeof(text), "%.3f", value);
  return text;
}

void add_value(const std::string& key, const std::string& value,
               diagnostic_msgs::DiagnosticStatus* status) {
  diagnostic_msgs::KeyValue entry;
  entry.key = key;
  entry.value = value;
  status->values.push_back(entry);
}

// Levels of diagnostic_msgs::DiagnosticStatus; they are constants of one type, the field is of
// another.
void worsen(std::uint8_t level, const std::string& message,
            diagnostic_msgs::DiagnosticStatus* status) {
  const auto before = static_cast<std::uint8_t>(status->level);
  if (level < before) return;
  status->message =
      level == before && !status->message.empty() ? status->message + "; " + message : message;
  status->level = static_cast<std::int8_t>(level);
}

}  // namespace

std::string strategy_of(const BeaconMclOptions& options) {
  const PopulationControlOptions& population = options.population;
  std::string strategy = to_string(population.schedule);
  if (population.schedule == Schedule::effective_sample_size) {
    char text[40];
    std::snprintf(text, sizeof(text), " < %g", population.threshold);
    strategy += text;
  } else if (population.schedule == Schedule::every_n) {
    strategy += " " + std::to_string(population.every_n);
  }
  strategy += ", " + to_string(population.renewal);
  if (population.renewal == Renewal::resampling) {
    strategy += " " + to_string(population.resampling.scheme);
  }
  return strategy + ", " + to_string(options.excitation.excitation);
}

bool BeaconMclPipeline::is_due(double period, ros::Time stamp, ros::Time* last) const {
  // A little less than the period, so that rounded stamps do not skip a message.
  if (!last->isZero() && stamp >= *last && (stamp - *last).toSec() < period - 1e-4) return false;
  *last = stamp;
  return true;
}

void BeaconMclPipeline::publish_pose(ros::Time stamp) {
  const std::optional<PoseEstimate> belief = estimate();
  if (!belief) return;
  if (!is_finite(*belief)) {
    ++not_published_;
    return;
  }
  if (sinks_.estimate) sinks_.estimate(stamp, *belief);
  if (sinks_.pose) {
    geometry_msgs::PoseWithCovarianceStamped message;
    message.header.stamp = stamp;
    message.header.frame_id = options_.map_frame;
    message.pose.pose = to_pose_message(belief->mean);
    message.pose.covariance = to_covariance_message(belief->covariance);
    sinks_.pose(message);
  }
  if (sinks_.transform) {
    // map -> odom such that the robot is where it is believed: map -> base = map -> odom -> base.
    const Pose2& base = odometry_.newest_pose();
    const Pose2 odom = compose(belief->mean, relative(base, Pose2{}));
    geometry_msgs::TransformStamped transform;
    transform.header.stamp = stamp + ros::Duration(options_.transform_tolerance);
    transform.header.frame_id = options_.map_frame;
    transform.child_frame_id = options_.odom_frame;
    transform.transform.translation.x = odom.x;
    transform.transform.translation.y = odom.y;
    transform.transform.rotation = to_quaternion_message(odom.heading);
    sinks_.transform(transform);
  }
  if (sinks_.path && position_sigma(*belief) <= options_.path_max_sigma) {
    path_.add(stamp, options_.map_frame, belief->mean);
  }
}

// What is for looking at, at rates of its own.
void BeaconMclPipeline::publish_pictures(ros::Time stamp) {
  if ((sinks_.particlecloud || sinks_.particles) && belief_ &&
      is_due(options_.cloud_period, stamp, &last_cloud_)) {
    const BeaconMclParticles& particles = filter_->particles();
    const ParticleView view = {particles.x, particles.y, particles.heading, particles.weight,
                               particles.ancestor};
    const Pose2 motion = moved_by(PoseEstimate{}, since_, yaw_rate_bias_).mean;
    if (sinks_.particlecloud) {
      geometry_msgs::PoseArray cloud = to_pose_array(view, motion);
      cloud.header.stamp = stamp;
      cloud.header.frame_id = options_.map_frame;
      if (std::all_of(cloud.poses.begin(), cloud.poses.end(),
                      [](const geometry_msgs::Pose& pose) { return is_finite(pose); })) {
        sinks_.particlecloud(cloud);
      } else {
        ++not_published_;
      }
    }
    if (sinks_.particles) {
      sensor_msgs::PointCloud2 cloud = to_point_cloud(view, motion);
      cloud.header.stamp = stamp;
      cloud.header.frame_id = options_.map_frame;
      if (is_finite(cloud)) {
        sinks_.particles(cloud);
      } else {
        ++not_published_;
      }
    }
  }
  if (sinks_.markers && filter_ && is_due(options_.marker_period, stamp, &last_markers_)) {
    publish_markers(stamp);
  }
  if (sinks_.path && !path_.path().poses.empty() &&
      is_due(options_.path_period, stamp, &last_path_)) {
    sinks_.path(path_.path());
  }
  if (sinks_.diagnostics && is_due(options_.diagnostics_period, stamp, &last_diagnostics_)) {
    publish_diagnostics(stamp);
  }
}

void BeaconMclPipeline::publish_markers(ros::Time stamp) {
  const MarkerFrame frame = {options_.map_frame, stamp};
  const std::vector<Beacon>& beacons = filter_->beacons();
  const double extent = extent_of(beacons);
  const double line = 0.002 * extent;
  visualization_msgs::MarkerArray markers;
  const auto take = [&](const visualization_msgs::Marker& marker) {
    if (is_finite(marker)) {
      markers.markers.push_back(marker);
    } else {
      ++not_published_;
    }
  };
  if (is_due(kBeaconMarkerPeriod, stamp, &last_beacons_)) {
    for (const auto& marker : beacon_markers(frame, beacons, 0.025 * extent).markers) take(marker);
  }
  for (std::size_t i = 0; i < beacons.size(); ++i) {
    const auto latest = latest_ranges_.find(beacons[i].id);
    if (latest == latest_ranges_.end()) continue;
    const double age = (stamp - latest->second.stamp).toSec();
    if (age > options_.ring_lifetime) continue;
    const double distance = filter_->corrected_range(beacons[i].id, latest->second.range);
    take(range_ring_marker(frame, beacons[i], static_cast<int>(i), distance,
                           latest->second.antenna_height, options_.ring_lifetime - age, line));
  }
  if (const auto belief = estimate()) {
    for (const auto& marker : pose_ellipse_markers(frame, *belief, 1.5 * line).markers)
      take(marker);
  }
  sinks_.markers(markers);
}

void BeaconMclPipeline::publish_status(ros::Time stamp, double update_time) {
  if (!sinks_.status) return;
  const BeaconMclStatus& filter = filter_->status();
  FilterStatus message;
  message.header.stamp = stamp;
  message.header.frame_id = options_.map_frame;
  message.strategy = strategy_;
  message.particles = static_cast<std::uint32_t>(filter.particles);
  message.effective_sample_size = filter.effective_sample_size;
  message.entropy_sample_size = filter.entropy_sample_size;
  message.distinct_ancestors = static_cast<std::uint32_t>(filter.distinct_ancestors);
  message.renewed = filter.renewed;
  message.updates = static_cast<std::uint64_t>(filter.updates);
  message.renewals = static_cast<std::uint64_t>(filter.renewals);
  message.weight_resets = static_cast<std::uint64_t>(filter.weight_resets);
  message.injected = static_cast<std::uint64_t>(filter.injected);
  message.log_likelihood = filter.log_likelihood;
  message.observation = filter.observation;
  message.innovation = filter.innovation;
  message.innovation_sigma = filter.innovation_sigma;
  message.update_time = update_time;
  message.queued = static_cast<std::uint32_t>(ranges_.size());
  for (const RejectCounter::Count& count : rejects_.counts()) {
    RejectCount reject;
    reject.input = count.input;
    reject.reason = to_string(count.reason);
    reject.count = count.count;
    message.rejects.push_back(reject);
  }
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
  if (is_finite(message)) {
    sinks_.status(message);
  } else {
    ++not_published_;
  }
}

void BeaconMclPipeline::publish_diagnostics(ros::Time stamp) {
  using diagnostic_msgs::DiagnosticStatus;
  diagnostic_msgs::DiagnosticArray array;
  array.header.stamp = stamp;

  DiagnosticStatus localization;
  localization.name = "beacon_mcl: localization";
  localization.hardware_id = "none";
  localization.level = DiagnosticStatus::OK;
  const std::optional<PoseEstimate> belief = estimate();
  if (!filter_) {
    worsen(DiagnosticStatus::WARN, "waiting for the beacons", &localization);
  } else if (!belief) {
    worsen(DiagnosticStatus::WARN, "waiting for ranges to start from", &localization);
  } else {
    const double sigma = position_sigma(*belief);
    if (!std::isfinite(sigma)) {
      worsen(DiagnosticStatus::ERROR, "the belief is not finite", &localization);
    } else if (sigma > kUnknownPosition * extent_of(filter_->beacons())) {
      worsen(DiagnosticStatus::WARN, "position not known yet", &localization);
    }
    if (misfit_ > kMisfitLimit) {
      worsen(DiagnosticStatus::WARN, "the ranges do not fit the belief: lost?", &localization);
    }
    const BeaconMclStatus& status = filter_->status();
    if (status.weight_resets > reported_weight_resets_) {
      worsen(DiagnosticStatus::ERROR, "all weights vanished and were reset", &localization);
    }
    reported_weight_resets_ = status.weight_resets;
    add_value("position sigma [m]", number_text(sigma), &localization);
    add_value("misfit (1 expected)", number_text(misfit_), &localization);
    add_value("particles", std::to_string(status.particles), &localization);
    add_value("effective sample size", number_text(status.effective_sample_size), &localization);
    add_value("updates", std::to_string(status.updates), &localization);
    add_value("renewals", std::to_string(status.renewals), &localization);
    add_value("injected particles", std::to_string(status.injected), &localization);
    add_value("weight resets", std::to_string(status.weight_resets), &localization);
    add_value("strategy", strategy_, &localization);
  }
  if (not_published_ > 0) {
    worsen(DiagnosticStatus::ERROR, "messages with NaN or infinity were held back", &localization);
    add_value("messages held back", std::to_string(not_published_), &localization);
  }
  if (localization.message.empty()) localization.message = "localized";
  array.status.push_back(localization);

  DiagnosticStatus inputs;
  inputs.name = "beacon_mcl: inputs";
  inputs.hardware_id = "none";
  inputs.level = DiagnosticStatus::OK;
  if (odometry_.empty()) {
    worsen(DiagnosticStatus::WARN, "no odometry yet", &inputs);
  } else if ((stamp - odometry_.newest()).toSec() > kRangeSilence) {
    worsen(DiagnosticStatus::WARN,
           "no odometry for " + number_text((stamp - odometry_.newest()).toSec()) + " s", &inputs);
  }
  if (last_range_.isZero()) {
    worsen(DiagnosticStatus::WARN, "no usable range yet", &inputs);
  } else if ((stamp - last_range_).toSec() > kRangeSilence) {
    worsen(DiagnosticStatus::WARN,
           "no usable range for " + number_text((stamp - last_range_).toSec()) + " s", &inputs);
  }
  if (rejects_.total() > reported_rejects_) {
    worsen(DiagnosticStatus::WARN,
           std::to_string(rejects_.total() - reported_rejects_) + " messages rejected", &inputs);
  }
  reported_rejects_ = rejects_.total();
  if (inputs.message.empty()) inputs.message = "fine";
  add_value("ranges waiting", std::to_string(ranges_.size()), &inputs);
  add_value("jumps back in time", std::to_string(time_jumps_), &inputs);
  add_value("jumps of the odometry", std::to_string(pose_jumps_), &inputs);
  for (const RejectCounter::Count& count : rejects_.counts()) {
    add_value("rejected " + count.input + " " + to_string(count.reason),
              std::to_string(count.count) + ", last: " + count.latest, &inputs);
  }
  array.status.push_back(inputs);
  sinks_.diagnostics(array);
}

void BeaconMclPipeline::report_silence(ros::Time now) {
  if (sinks_.diagnostics && is_due(options_.diagnostics_period, now, &last_diagnostics_)) {
    publish_diagnostics(now);
  }
}

}  // namespace pf_resampling
