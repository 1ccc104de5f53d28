#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "pf_resampling/conversions.hpp"
#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

// Weight of a new range in the running mean of how well ranges fit.
constexpr double kMisfitRate = 0.05;

std::string seconds_text(double seconds) {
  char text[40];
  std::snprintf(text, sizeof(text), "%.3f s", seconds);
  return text;
}

bool same_beacons(const std::vector<Beacon>& first, const std::vector<Beacon>& second) {
  return std::equal(first.begin(), first.end(), second.begin(), second.end(),
                    [](const Beacon& a, const Beacon& b) {
                      return a.id == b.id && a.is_planar == b.is_planar && a.position == b.position;
                    });
}

}  // namespace

PoseEstimate moved_by(const PoseEstimate& estimate, const OdometryIncrement& motion,
                      const ScalarEstimate& yaw_rate_bias) {
  // Dead reckoning turns by its bias too much.
  const Eigen::Vector3d& sensitivity = motion.yaw_rate_sensitivity;
  const Pose2 corrected = {motion.mean.x - sensitivity[0] * yaw_rate_bias.mean,
                           motion.mean.y - sensitivity[1] * yaw_rate_bias.mean,
                           motion.mean.heading - sensitivity[2] * yaw_rate_bias.mean};
  PoseEstimate moved;
  moved.mean = compose(estimate.mean, corrected);
  Eigen::Matrix3d by_start = Eigen::Matrix3d::Identity();
  by_start(0, 2) = -(moved.mean.y - estimate.mean.y);
  by_start(1, 2) = moved.mean.x - estimate.mean.x;
  const double cosine = std::cos(estimate.mean.heading);
  const double sine = std::sin(estimate.mean.heading);
  Eigen::Matrix3d to_map = Eigen::Matrix3d::Identity();
  to_map.topLeftCorner<2, 2>() << cosine, -sine, sine, cosine;
  const Eigen::Matrix3d of_motion = motion.covariance + yaw_rate_bias.sigma * yaw_rate_bias.sigma *
                                                            sensitivity * sensitivity.transpose();
  moved.covariance = by_start * estimate.covariance * by_start.transpose() +
                     to_map * of_motion * to_map.transpose();
  return moved;
}

BeaconMclPipeline::BeaconMclPipeline(const BeaconMclPipelineOptions& options, BeaconMclSinks sinks)
    : options_(options),
      sinks_(std::move(sinks)),
      strategy_(strategy_of(options.filter)),
      odometry_(options.odometry_input),
      path_(options.path_spacing, options.path_length) {
  validate(options_.filter);
  for (const auto& [frame, place] : options_.antennas) {
    frames_.add(options_.base_frame, frame, place);
  }
  if (!options_.beacons.empty()) start_filter(options_.beacons);
}

void BeaconMclPipeline::start_filter(const std::vector<Beacon>& beacons) {
  const std::vector<std::pair<int, RangeCalibration>> calibration(options_.calibration.begin(),
                                                                  options_.calibration.end());
  filter_ = std::make_unique<BeaconMcl>(options_.filter, beacons,
                                        static_cast<std::uint64_t>(options_.seed), calibration);
  latest_ranges_.clear();
  path_.clear();
  misfit_ = 1.0;
  filter_time_.reset();
  if (!odometry_.empty()) {
    filter_time_ = odometry_.oldest();
    since_ = odometry_.integrate(*filter_time_, odometry_.newest(), options_.filter.odometry);
  }
  if (pending_start_) {
    start_about(pending_start_->first, pending_start_->second);
    pending_start_.reset();
  } else {
    take_belief();
  }
}

// ---- messages in ------------------------------------------------------------------------------

void BeaconMclPipeline::handle(const nav_msgs::Odometry& message) {
  if (const auto rejection = check(message, options_)) return reject("odom", *rejection);
  const StampedOdometry odometry = to_stamped_odometry(message);
  const bool first = odometry_.empty();
  const ros::Time before = first ? ros::Time() : odometry_.newest();
  const OdometryBuffer::Addition addition = odometry_.add(odometry);
  const std::string step = first ? "" : seconds_text((odometry.stamp - before).toSec());
  switch (addition) {
    case OdometryBuffer::Addition::added:
      break;
    case OdometryBuffer::Addition::out_of_order:
      return reject("odom", {RejectReason::out_of_order, step + " after the newest"});
    case OdometryBuffer::Addition::time_jump:
      return reject("odom", {RejectReason::time_jump, step + " after the newest"});
    case OdometryBuffer::Addition::time_gap:
      return reject("odom", {RejectReason::time_gap, step + " after the newest"});
    case OdometryBuffer::Addition::pose_jump:
      return reject("odom", {RejectReason::pose_jump,
                             "it moves faster than odometry_input/max_speed and max_turn_rate"});
    case OdometryBuffer::Addition::time_jumped_back:
      ++time_jumps_;
      log(LogLevel::warning,
          "time jumped back by " + seconds_text((before - odometry.stamp).toSec()) +
              ": buffers are reset" +
              (options_.restart_after_jump_back ? ", the filter starts anew" : ""));
      forget_time();
      break;
    case OdometryBuffer::Addition::gap_closed:
      log(LogLevel::warning, "no odometry for " + step);
      break;
    case OdometryBuffer::Addition::pose_jumped:
      ++pose_jumps_;
      log(LogLevel::warning, "the odometry jumped: the jump is taken as no motion");
      break;
  }
  if (odometry_start_.isZero()) odometry_start_ = odometry_.oldest();
  ros::Time integrated = before;
  if (filter_ && !filter_time_) {
    filter_time_ = odometry_.oldest();
    since_ = OdometryIncrement{};
    integrated = *filter_time_;
  }
  if (filter_time_) {
    odometry_.extend(integrated, odometry_.newest(), options_.filter.odometry, &since_);
  }
  process_ready_ranges();
  carry_belief_forward();
  publish_pose(odometry_.newest());
  publish_pictures(odometry_.newest());
}

void BeaconMclPipeline::handle(const BeaconRange& range) {
  if (const auto rejection = check(range)) return reject("ranges", *rejection);
  if (filter_ && !knows_beacon(range.beacon)) return reject("ranges", unknown_beacon(range.beacon));
  if (!odometry_.empty()) {
    const double ahead = (range.header.stamp - odometry_.newest()).toSec();
    if (ahead > options_.max_ahead) {
      return reject("ranges", {RejectReason::ahead_of_odometry,
                               seconds_text(ahead) + " newer than the newest odometry"});
    }
  }
  const auto place = std::upper_bound(
      ranges_.begin(), ranges_.end(), range.header.stamp,
      [](const ros::Time& stamp, const BeaconRange& other) { return stamp < other.header.stamp; });
  ranges_.insert(place, range);
  if (queued() > options_.queue_length) {
    reject("ranges", {RejectReason::queue_full,
                      "more than " + std::to_string(options_.queue_length) + " wait for " +
                          (filter_ ? "odometry" : "the beacons") + ": the oldest is dropped"});
    ranges_.pop_front();
  }
  process_ready_ranges();
}

void BeaconMclPipeline::handle(const BeaconArray& message) {
  if (const auto rejection = check(message, options_)) return reject("beacons", *rejection);
  const std::vector<Beacon> beacons = to_beacons(message);
  if (filter_ && same_beacons(beacons, filter_->beacons())) return;
  if (!options_.beacons.empty()) {
    return reject("beacons",
                  {RejectReason::ignored, "they differ from those of the configuration"});
  }
  if (filter_) log(LogLevel::warning, "the beacons changed: the filter starts anew");
  try {
    start_filter(beacons);
  } catch (const Error& error) {
    return reject("beacons", {RejectReason::filter_error, error.what()});
  }
  process_ready_ranges();
}

void BeaconMclPipeline::handle(const geometry_msgs::PoseWithCovarianceStamped& message) {
  if (const auto rejection = check(message, options_)) return reject("initialpose", *rejection);
  const PoseEstimate start = {to_pose2(message.pose.pose), to_covariance3(message.pose.covariance)};
  if (filter_) {
    start_about(start, message.header.stamp);
  } else {
    pending_start_ = {start, message.header.stamp};
  }
}

void BeaconMclPipeline::handle(const tf2_msgs::TFMessage& message) {
  for (const geometry_msgs::TransformStamped& transform : message.transforms) {
    // Where the robot is is not ours to learn from tf.
    const std::string child = without_slash(transform.child_frame_id);
    if (child == options_.base_frame || child == options_.odom_frame) continue;
    if (!frames_.add(transform)) {
      reject("tf", {RejectReason::not_finite, "the transform of frame '" + child +
                                                  "' is no rigid motion from another frame"});
    }
  }
}

void BeaconMclPipeline::global_localization() {
  if (!filter_) return;
  filter_->global_localization();
  path_.clear();
  misfit_ = 1.0;
  take_belief();
}

void BeaconMclPipeline::reset() {
  odometry_.clear();
  forget_time();
  if (filter_) filter_->reset();
  misfit_ = 1.0;
  path_.clear();
  take_belief();
}

// ---- the flow ---------------------------------------------------------------------------------

void BeaconMclPipeline::start_about(const PoseEstimate& start, ros::Time stamp) {
  try {
    filter_->initialize_gaussian(start.mean, start.covariance);
  } catch (const Error& error) {
    take_belief();
    return reject("initialpose", {RejectReason::filter_error, error.what()});
  }
  if (!odometry_.empty()) {
    filter_time_ = odometry_.covers(stamp) ? stamp : odometry_.newest();
    since_ = odometry_.integrate(*filter_time_, odometry_.newest(), options_.filter.odometry);
  }
  path_.clear();
  misfit_ = 1.0;
  take_belief();
}

void BeaconMclPipeline::process_ready_ranges() {
  while (filter_ && !ranges_.empty() && !odometry_.empty() &&
         ranges_.front().header.stamp <= odometry_.newest()) {
    const ros::Time first = ranges_.front().header.stamp;
    const ros::Duration tolerance(options_.simultaneous);
    if (first < odometry_start_) {
      reject("ranges",
             {RejectReason::before_odometry,
              seconds_text((odometry_start_ - first).toSec()) + " before the first odometry"});
      ranges_.pop_front();
      continue;
    }
    if (first + tolerance < *filter_time_) {
      reject("ranges", {RejectReason::old, seconds_text((*filter_time_ - first).toSec()) +
                                               " older than what the filter has used"});
      ranges_.pop_front();
      continue;
    }
    std::vector<BeaconRange> group;
    while (!ranges_.empty() && ranges_.front().header.stamp <= odometry_.newest() &&
           ranges_.front().header.stamp - first <= tolerance) {
      group.push_back(ranges_.front());
      ranges_.pop_front();
    }
    update(group);
  }
}

void BeaconMclPipeline::update(const std::vector<BeaconRange>& group) {
  std::vector<RangeObservation> observations;
  for (const BeaconRange& range : group) {
    if (const auto observation = to_observation(range)) observations.push_back(*observation);
  }
  if (observations.empty()) return;
  const ros::Time stamp = std::max(group.back().header.stamp, *filter_time_);
  const double start = sinks_.stopwatch ? sinks_.stopwatch() : 0.0;
  try {
    filter_->update(odometry_.integrate(*filter_time_, stamp, options_.filter.odometry),
                    observations);
  } catch (const Error& error) {
    return reject("ranges", {RejectReason::filter_error, error.what()});
  }
  const double update_time = sinks_.stopwatch ? sinks_.stopwatch() - start : 0.0;

  filter_time_ = stamp;
  since_ = odometry_.integrate(stamp, odometry_.newest(), options_.filter.odometry);
  take_belief();
  last_range_ = stamp;
  for (const RangeObservation& observation : observations) {
    latest_ranges_[observation.beacon] = {stamp, observation.range, observation.antenna.z()};
  }
  const BeaconMclStatus& status = filter_->status();
  if (status.innovation_sigma > 0.0) {
    const double ratio = status.innovation / status.innovation_sigma;
    misfit_ += kMisfitRate * (ratio * ratio - misfit_);
  }
  publish_status(stamp, update_time);
}

std::optional<RangeObservation> BeaconMclPipeline::to_observation(const BeaconRange& range) {
  if (!knows_beacon(range.beacon)) {
    reject("ranges", unknown_beacon(range.beacon));
    return std::nullopt;
  }
  const auto antenna = frames_.origin(options_.base_frame, without_slash(range.header.frame_id));
  if (!antenna) {
    reject("ranges", {RejectReason::unknown_frame,
                      "where '" + range.header.frame_id + "' is on '" + options_.base_frame +
                          "' is not known: give it on /tf_static, or in the list "
                          "`antennas` of the configuration"});
    return std::nullopt;
  }
  return RangeObservation{range.beacon, range.range, range.variance, *antenna};
}

// The odometry kept is bounded: without ranges the particles move on by odometry alone.
void BeaconMclPipeline::carry_belief_forward() {
  if (!filter_time_) return;
  const double length = options_.odometry_input.length;
  if ((odometry_.newest() - *filter_time_).toSec() < 0.5 * length) return;
  const ros::Time stamp = odometry_.newest() - ros::Duration(0.25 * length);
  filter_->update(odometry_.integrate(*filter_time_, stamp, options_.filter.odometry), {});
  filter_time_ = stamp;
  since_ = odometry_.integrate(stamp, odometry_.newest(), options_.filter.odometry);
  take_belief();
}

void BeaconMclPipeline::take_belief() {
  belief_.reset();
  if (!filter_ || !filter_->is_initialized()) return;
  belief_ = filter_->estimate();
  yaw_rate_bias_ = filter_->yaw_rate_bias();
}

void BeaconMclPipeline::forget_time() {
  if (!ranges_.empty()) {
    log(LogLevel::info, std::to_string(ranges_.size()) + " waiting ranges are dropped");
  }
  ranges_.clear();
  latest_ranges_.clear();
  path_.clear();
  filter_time_.reset();
  odometry_start_ = ros::Time();
  since_ = OdometryIncrement{};
  if (filter_ && options_.restart_after_jump_back) {
    filter_->reset();
    misfit_ = 1.0;
  }
  take_belief();
}

std::optional<PoseEstimate> BeaconMclPipeline::estimate() const {
  if (!belief_) return std::nullopt;
  return moved_by(*belief_, since_, yaw_rate_bias_);
}

bool BeaconMclPipeline::knows_beacon(int id) const {
  const auto& beacons = filter_->beacons();
  return std::any_of(beacons.begin(), beacons.end(),
                     [id](const Beacon& beacon) { return beacon.id == id; });
}

Rejection BeaconMclPipeline::unknown_beacon(int id) const {
  std::string known;
  for (const Beacon& beacon : filter_->beacons()) {
    known += (known.empty() ? "" : ", ") + std::to_string(beacon.id);
  }
  return {RejectReason::unknown_beacon,
          "beacon " + std::to_string(id) + " is none of those known: " + known};
}

void BeaconMclPipeline::reject(const std::string& input, const Rejection& rejection) {
  if (rejects_.count(input, rejection.reason) == 0) {
    log(LogLevel::warning, input + ": rejected, " + to_string(rejection.reason) + ": " +
                               rejection.detail + " (said once; counted in status)");
  }
  rejects_.add(input, rejection.reason, rejection.detail);
}

void BeaconMclPipeline::log(LogLevel level, const std::string& text) const {
  if (sinks_.log) sinks_.log(level, text);
}

}  // namespace pf_resampling
