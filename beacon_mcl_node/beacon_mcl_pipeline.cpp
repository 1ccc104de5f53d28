#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"

#include <algorithm>

#include "beacon_mcl_node/beacon_checks.hpp"
#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/strategy/strategy.hpp"
#include "src/messages/conversions.hpp"
#include "src/messages/given_particles_message.hpp"
#include "src/messages/input_checks.hpp"
#include "src/pictures/markers.hpp"

namespace pf_resampling {
namespace {

// Weight of a new range in the running means of a beacon, and what its squared innovation is
// bounded by in them.
constexpr double kHealthRate = 0.1;
constexpr double kWildInnovation = 100.0;

bool same_beacons(const std::vector<Beacon>& first, const std::vector<Beacon>& second) {
  return std::equal(first.begin(), first.end(), second.begin(), second.end(),
                    [](const Beacon& a, const Beacon& b) {
                      return a.id == b.id && a.is_planar == b.is_planar && a.position == b.position;
                    });
}

BeaconNames names_of(const BeaconMclPipelineOptions& options) {
  return {options.beacon_frames, FramePattern(options.frame_pattern),
          options.antenna.empty() ? options.frames.base : options.antenna};
}

}  // namespace

BeaconMclPipeline::BeaconMclPipeline(const BeaconMclPipelineOptions& options, BeaconMclSinks sinks)
    : options_(options),
      sinks_(std::move(sinks)),
      names_(names_of(options)),
      strategy_(strategy_of(options.filter.strategy)),
      odometry_(options.odometry_input),
      publisher_(options.frames, options.output, &sinks_) {
  validate(options_.filter);
  for (const auto& [frame, place] : options_.antennas) {
    frames_.add(options_.frames.base, frame, place);
  }
  if (!options_.beacons.empty()) start_filter(options_.beacons);
}

std::unique_ptr<BeaconMcl> BeaconMclPipeline::make_filter(
    const std::vector<Beacon>& beacons) const {
  const std::vector<std::pair<int, RangeCalibration>> calibration(options_.calibration.begin(),
                                                                  options_.calibration.end());
  return std::make_unique<BeaconMcl>(options_.filter, beacons,
                                     static_cast<std::uint64_t>(options_.seed), calibration);
}

void BeaconMclPipeline::start_filter(const std::vector<Beacon>& beacons) {
  filter_ = make_filter(beacons);
  latest_ranges_.clear();
  beacon_health_.clear();
  publisher_.clear_path();
  lost_.reset();
  odometry_.restart_at_oldest(options_.filter.odometry);
  if (pending_start_) {
    start_about(pending_start_->first, pending_start_->second);
    pending_start_.reset();
  } else {
    take_belief();
  }
}

// ---- messages in ------------------------------------------------------------------------------

void BeaconMclPipeline::handle(const nav_msgs::Odometry& message) {
  if (const auto rejection = check(message, options_.frames)) return reject("odom", *rejection);
  const DeadReckoning::Taken taken = odometry_.take(message, options_.filter.odometry);
  if (taken.rejection) return reject("odom", *taken.rejection);
  if (!taken.warning.empty()) {
    const bool anew = taken.began_again && options_.restart_after_jump_back;
    log(LogLevel::warning, taken.warning + (anew ? ", the filter starts anew" : ""));
  }
  if (taken.time_jumped_back) forget_time(taken);
  process_ready();
  carry_belief_forward();
  if (const auto belief = estimate()) {
    publisher_.publish_pose(odometry_.newest(), *belief, odometry_.newest_pose());
  }
  publish_pictures(odometry_.newest());
}

void BeaconMclPipeline::handle(const BeaconRange& range) {
  if (const auto rejection = check(range)) return reject("ranges", *rejection);
  if (filter_ && !knows_beacon(range.beacon)) return reject("ranges", unknown_beacon(range.beacon));
  if (const auto rejection = odometry_.check_ahead(range.header.stamp, options_.max_ahead)) {
    return reject("ranges", *rejection);
  }
  const auto place = std::upper_bound(
      ranges_.begin(), ranges_.end(), range.header.stamp,
      [](const ros::Time& stamp, const BeaconRange& other) { return stamp < other.header.stamp; });
  ranges_.insert(place, range);
  if (queued() > options_.queue_length) {
    const bool is_late = filter_ && odometry_.covers(ranges_.front().header.stamp);
    reject("ranges", {is_late ? RejectReason::overload : RejectReason::queue_full,
                      "more than " + std::to_string(options_.queue_length) + " wait for " +
                          (is_late   ? "computation"
                           : filter_ ? "odometry"
                                     : "the beacons") +
                          ": the oldest is dropped"});
    ranges_.pop_front();
  }
  process_ready();
}

void BeaconMclPipeline::handle(const sensor_msgs::Range& message) {
  const RangeReading reading = read_range(message, names_);
  if (reading.rejection) return reject("sensor_ranges", *reading.rejection);
  if (reading.range) handle(*reading.range);
}

void BeaconMclPipeline::handle(const BeaconArray& message) {
  if (const auto rejection = check(message, options_.frames)) return reject("beacons", *rejection);
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
  process_ready();
}

void BeaconMclPipeline::handle(const geometry_msgs::PoseWithCovarianceStamped& message) {
  if (const auto rejection = check(message, options_.frames))
    return reject("initialpose", *rejection);
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
    if (child == options_.frames.base || child == options_.frames.odom) continue;
    if (!frames_.add(transform)) {
      reject("tf", {RejectReason::not_finite, "the transform of frame '" + child +
                                                  "' is no rigid motion from another frame"});
    }
  }
}

void BeaconMclPipeline::global_localization() {
  if (!filter_) return;
  filter_->global_localization();
  publisher_.clear_path();
  lost_.reset();
  take_belief();
}

void BeaconMclPipeline::reset() {
  odometry_.clear();
  forget_time();
  if (filter_) filter_->reset();
  lost_.reset();
  publisher_.clear_path();
  take_belief();
}

std::string BeaconMclPipeline::set_particles(const geometry_msgs::PoseArray& poses,
                                             const std::vector<double>& weights) {
  const GivenParticles particles = to_given_particles(poses, weights, options_.frames);
  if (!filter_) {
    throw Error(
        "set_particles: the beacons are not known yet; give them on the topic or in the "
        "configuration first");
  }
  const ros::Time stamp = stamp_of_given(poses.header.stamp, odometry_);
  filter_->set_particles(particles);
  odometry_.restart_at(stamp, options_.filter.odometry);
  publisher_.clear_path();
  lost_.reset();
  take_belief();
  return std::to_string(particles.poses.size()) + " particles set";
}

void BeaconMclPipeline::set_parameters(const std::map<std::string, std::string>& values) {
  BeaconMclPipelineOptions options = options_;
  try {
    pf_resampling::set_parameters(live_parameters_of(&options), values);
    validate(options.filter);
    if (filter_) filter_->set_options(options.filter);
  } catch (const Error& error) {
    refused_ = error.what();
    throw;
  }
  refused_.clear();
  options_.filter = options.filter;
  strategy_ = strategy_of(options_.filter.strategy);
  log(LogLevel::info, "strategy: " + strategy_);
}

// ---- the flow ---------------------------------------------------------------------------------

void BeaconMclPipeline::start_about(const PoseEstimate& start, ros::Time stamp) {
  try {
    filter_->initialize_gaussian(start.mean, start.covariance);
  } catch (const Error& error) {
    take_belief();
    return reject("initialpose", {RejectReason::filter_error, error.what()});
  }
  odometry_.restart_at(stamp, options_.filter.odometry);
  publisher_.clear_path();
  lost_.reset();
  take_belief();
}

void BeaconMclPipeline::process_ready() {
  while (!options_.deferred && process_next()) {
  }
}

// The oldest first, as long as there is another to use.
void BeaconMclPipeline::drop_late() {
  while (ranges_.size() > 1 && !odometry_.empty() &&
         ranges_[1].header.stamp <= odometry_.newest() &&
         (odometry_.newest() - ranges_.front().header.stamp).toSec() > options_.max_latency) {
    reject("ranges", {RejectReason::overload,
                      "computation does not keep up: what has waited longer "
                      "than range_input/max_latency is dropped"});
    ranges_.pop_front();
  }
}

bool BeaconMclPipeline::process_next() {
  if (options_.deferred) drop_late();
  while (filter_ && !ranges_.empty() && !odometry_.empty() &&
         ranges_.front().header.stamp <= odometry_.newest()) {
    const ros::Time first = ranges_.front().header.stamp;
    const ros::Duration tolerance(options_.simultaneous);
    if (const auto rejection = odometry_.check_stamp(first, options_.simultaneous)) {
      reject("ranges", *rejection);
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
    return true;
  }
  return false;
}

void BeaconMclPipeline::update(const std::vector<BeaconRange>& group) {
  std::vector<RangeObservation> observations;
  for (const BeaconRange& range : group) {
    if (const auto observation = to_observation(range)) observations.push_back(*observation);
  }
  if (observations.empty()) return;
  const ros::Time stamp = std::max(group.back().header.stamp, odometry_.used());
  const double start = sinks_.stopwatch ? sinks_.stopwatch() : 0.0;
  try {
    filter_->update(odometry_.until(stamp, options_.filter.odometry), observations);
  } catch (const Error& error) {
    return reject("ranges", {RejectReason::filter_error, error.what()});
  }
  const double update_time = sinks_.stopwatch ? sinks_.stopwatch() - start : 0.0;

  odometry_.use_until(stamp, options_.filter.odometry);
  take_belief();
  const double since_last = last_range_.isZero() ? 0.0 : (stamp - last_range_).toSec();
  last_range_ = stamp;
  timing_.add(update_time, stamp);
  latency_ = (odometry_.newest() - stamp).toSec();
  for (const RangeObservation& observation : observations) {
    latest_ranges_[observation.beacon] = {stamp, observation.range, observation.antenna.z()};
  }
  const BeaconMclStatus& status = filter_->status();
  if (status.innovation_sigma > 0.0) {
    const double ratio = status.innovation / status.innovation_sigma;
    lost_.observe(ratio * ratio, 1, since_last);
    note_health(stamp, status.observation, ratio * ratio);
  }
  publish_status(stamp, update_time);
}

void BeaconMclPipeline::note_health(ros::Time stamp, int beacon, double normalized_innovation) {
  BeaconHealth& health = beacon_health_[beacon];
  // A single wild range says little.
  const double bounded = std::min(normalized_innovation, kWildInnovation);
  health.normalized_innovation += kHealthRate * (bounded - health.normalized_innovation);
  if (!health.last.isZero() && stamp > health.last) {
    const double period = (stamp - health.last).toSec();
    health.period =
        health.period == 0.0 ? period : health.period + kHealthRate * (period - health.period);
  }
  health.last = stamp;
}

std::optional<RangeObservation> BeaconMclPipeline::to_observation(const BeaconRange& range) {
  if (!knows_beacon(range.beacon)) {
    reject("ranges", unknown_beacon(range.beacon));
    return std::nullopt;
  }
  const auto antenna = frames_.origin(options_.frames.base, without_slash(range.header.frame_id));
  if (!antenna) {
    reject("ranges", {RejectReason::unknown_frame,
                      "where '" + range.header.frame_id + "' is on '" + options_.frames.base +
                          "' is not known: give it on /tf_static, or in the list "
                          "`antennas` of the configuration"});
    return std::nullopt;
  }
  return RangeObservation{range.beacon, range.range, range.variance, *antenna};
}

// The odometry kept is bounded: without ranges the particles move on by odometry alone.
void BeaconMclPipeline::carry_belief_forward() {
  const std::optional<ros::Time> stamp = odometry_.overdue();
  if (!stamp || !filter_) return;
  filter_->update(odometry_.until(*stamp, options_.filter.odometry), {});
  odometry_.use_until(*stamp, options_.filter.odometry);
  take_belief();
}

double BeaconMclPipeline::lost_probability() const {
  const std::optional<PoseEstimate> belief = estimate();
  if (!belief) return 1.0;
  const double extent = extent_of(filter_->beacons());
  return either_probability(lost_.probability(),
                            unknown_probability(position_sigma(*belief), extent));
}

void BeaconMclPipeline::take_belief() {
  belief_.reset();
  if (!filter_ || !filter_->is_initialized()) return;
  belief_ = filter_->estimate();
  yaw_rate_bias_ = filter_->yaw_rate_bias();
}

void BeaconMclPipeline::forget_time(const DeadReckoning::Taken& jump) {
  if (!ranges_.empty()) {
    log(LogLevel::info, std::to_string(ranges_.size()) + " waiting ranges are dropped");
  }
  ranges_.clear();
  latest_ranges_.clear();
  beacon_health_.clear();
  last_range_ = ros::Time();
  publisher_.clear_path();
  if (filter_ && jump.began_again && options_.restart_after_jump_back) {
    filter_->reset();
    lost_.reset();
  } else if (filter_ && jump.time_jumped_back) {
    filter_->update(jump.until_jump, {});
  }
  take_belief();
}

std::optional<PoseEstimate> BeaconMclPipeline::estimate() const {
  if (!belief_) return std::nullopt;
  return moved_by(*belief_, odometry_.since(), yaw_rate_bias_.mean, yaw_rate_bias_.sigma);
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
