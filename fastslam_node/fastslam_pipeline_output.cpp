// What of the messages that FastSlamPipeline gives out is its own.
#include <algorithm>
#include <cmath>

#include "fastslam_node/fastslam_pipeline.hpp"
#include "src/diagnostics/diagnostics.hpp"
#include "src/messages/conversions.hpp"
#include "src/pictures/markers.hpp"

namespace pf_resampling {
namespace {

// Weights add up to one but for this.
constexpr double kRounding = 1e-9;
// How long, s, a scan is shown at least.
constexpr double kScanShown = 1.0;
// So many sightings of one landmark in a row that do not fit are no chance.
constexpr int kManyDoubts = 3;

// The filter has what the odometry misses; people calibrate what it counts.
void fill_in_odometry_errors(const OdometryErrorState& errors, ConstArray weights,
                             FilterStatus* status) {
  const auto mean = [&](int error) { return (weights * errors.means.col(error)).sum(); };
  const auto sigma = [&](int error) {
    const auto squares = (errors.means.col(error) - mean(error)).square();
    return std::sqrt(std::max(0.0, errors.covariance(error, error) + (weights * squares).sum()));
  };
  if (!(errors.covariance.diagonal().maxCoeff() > 0.0)) return;  // none is estimated
  const char* const scales[] = {"distance_scale", "turn_scale"};
  for (int error = 0; error < 2; ++error) {
    const double measured = 1.0 / (1.0 + mean(error));
    const double deviation = measured * measured * sigma(error);
    if (!std::isfinite(deviation)) continue;  // it counts although the robot stands
    status->systematic_errors.push_back(to_systematic_error(scales[error], measured, deviation));
  }
  constexpr int kYawRate = 3;
  status->yaw_rate_bias = -mean(kYawRate);
  status->yaw_rate_bias_sigma = sigma(kYawRate);
}

}  // namespace

void FastSlamPipeline::publish_results() {
  if (options_.filter.strategy.renewal != Renewal::redraw) return publish_map_and_path();
  auto smoothed = std::make_unique<FastSlam>(*filter_);
  smoothed->smooth();
  smoothed.swap(filter_);
  try {
    publish_map_and_path();
  } catch (...) {
    smoothed.swap(filter_);
    throw;
  }
  smoothed.swap(filter_);
}

void FastSlamPipeline::publish_map_and_path() {
  if (odometry_.empty()) return;
  publish_map(odometry_.newest());
  publisher_.hurry_path();
  publish_path(odometry_.newest());
  if (own_sinks_.final_path) own_sinks_.final_path(path_stamps_, filter_->path());
}

void FastSlamPipeline::publish_map_if_due(ros::Time stamp) {
  const bool is_wanted = own_sinks_.landmark_map || sinks_.markers;
  if (is_wanted && is_due(options_.map_period, stamp, &last_map_)) publish_map(stamp);
}

void FastSlamPipeline::publish_map(ros::Time stamp) {
  map_.clear();
  for (const LandmarkEstimate& landmark : filter_->map()) {
    if (landmark.held >= options_.map_min_held - kRounding) map_.push_back(landmark);
  }
  if (!own_sinks_.landmark_map) return;
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
  own_sinks_.landmark_map(message);
}

// The whole path as it is believed now: what came later corrects what was driven before.
void FastSlamPipeline::publish_path(ros::Time stamp) {
  publisher_.publish_path(stamp, path_stamps_, [this] { return filter_->path(); });
}

visualization_msgs::MarkerArray FastSlamPipeline::markers(ros::Time stamp) {
  const MarkerFrame frame = {options_.frames.map, stamp};
  const std::optional<PoseEstimate> belief = estimate();
  const double extent = std::max(extent_of(map_), belief ? this->extent(*belief) : 0.0);
  const double line = std::max(0.0015 * extent, 0.01);
  visualization_msgs::MarkerArray markers = landmark_markers(frame, map_, line);
  // Labels of many landmarks would cover each other.
  const double label = std::min(0.02, 0.2 / std::sqrt(1.0 + static_cast<double>(map_.size())));
  append(label_markers(frame, map_, std::max(label * extent, 0.1), &labels_), &markers);
  ScanPicture scan;
  const double shown = std::max(kScanShown, 2.0 * options_.output.marker_period);
  if (latest_ && (stamp - latest_->first).toSec() <= shown) scan = latest_->second;
  append(association_markers(frame, scan, map_, line, shown), &markers);
  if (belief) append(pose_ellipse_markers(frame, *belief, 2.0 * line), &markers);
  return markers;
}

void FastSlamPipeline::fill_in(FilterStatus* status) const {
  status->map_file = loaded_map_;
  status->not_believed = not_believed_;
  status->landmarks = static_cast<std::uint32_t>(filter_->status().landmarks);
  status->redraws = static_cast<std::uint64_t>(filter_->status().redraws);
  status->redraws_refused = static_cast<std::uint64_t>(filter_->status().redraws_refused);
  status->redraw_innovation = filter_->status().redraw_innovation;
  status->redraw_innovation_observations =
      static_cast<std::uint32_t>(filter_->status().redraw_innovation_observations);
  const NoiseScales& noise = filter_->noise();
  status->range_noise_scale = noise.range;
  status->bearing_noise_scale = noise.bearing;
  status->odometry_noise_scale = noise.motion;
  status->observation = -1;
  fill_in_odometry_errors(filter_->odometry_errors().state(), filter_->particles().weight, status);
}

void FastSlamPipeline::add_health(HealthInputs* inputs) const {
  inputs->needs_past = !options_.filter.map.frozen;
  inputs->renews_past = can_redraw();
  inputs->is_placed = filter_->is_placed();
  inputs->is_contradicted = filter_->memory().distrusts_odometry();
  inputs->misses_landmarks = filter_->memory().misses_landmarks() || changes_.map_misfits();
  if (doubts_ >= kManyDoubts) inputs->misfit = "the sightings of a landmark";
}

bool FastSlamPipeline::can_redraw() const {
  const StrategyOptions& strategy = options_.filter.strategy;
  return strategy.renewal == Renewal::redraw &&
         filter_->status().landmarks <= strategy.redraw.max_landmarks;
}

void FastSlamPipeline::diagnose(diagnostic_msgs::DiagnosticStatus* entry) {
  using diagnostic_msgs::DiagnosticStatus;
  const FastSlamStatus& status = filter_->status();
  if (!start_problem_.empty()) worsen(DiagnosticStatus::ERROR, start_problem_, entry);
  if (search_) {
    worsen(DiagnosticStatus::WARN,
           search_->is_ambiguous()
               ? "global localization: what was seen lately fits the map from several places"
               : "global localization in the whole map",
           entry);
  }
  if (status.landmarks == 0) {
    worsen(DiagnosticStatus::WARN, "no landmark has been seen yet", entry);
  }
  if (status.injected > reported_injected_) {
    worsen(DiagnosticStatus::WARN,
           "was lost: the robot was placed where the observed landmarks fit", entry);
  }
  reported_injected_ = status.injected;
  if (options_.filter.strategy.renewal == Renewal::redraw && !can_redraw()) {
    worsen(DiagnosticStatus::WARN,
           "no redraw: the map has more than " +
               std::to_string(options_.filter.strategy.redraw.max_landmarks) +
               " landmarks (population/redraw/max_landmarks); only resampling continues",
           entry);
  }
  const NoiseScales& noise = filter_->noise();
  add_value("landmarks", std::to_string(status.landmarks), entry);
  add_value("observations not believed",
            std::to_string(not_believed_) +
                (not_believed_ > 0 ? ", last: " + last_not_believed_ : std::string()),
            entry);
  add_value("scans with an id in two positions",
            std::to_string(ids_at_two_places_) +
                (ids_at_two_places_ > 0 ? ", last: " + last_id_at_two_places_ : std::string()),
            entry);
  add_value("redraws", std::to_string(status.redraws), entry);
  add_value("redraws refused", std::to_string(status.redraws_refused), entry);
  add_value("innovation after the last redraw (1 expected)", number_text(status.redraw_innovation),
            entry);
  add_value("noise scales of ranges, bearings, odometry",
            number_text(noise.range) + ", " + number_text(noise.bearing) + ", " +
                number_text(noise.motion),
            entry);
  add_value("data association", to_string(filter_->association()), entry);
}

}  // namespace pf_resampling
