#include "fastslam_node/fastslam_pipeline.hpp"

#include <algorithm>
#include <cmath>

#include "fastslam_node/landmark_checks.hpp"
#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/strategy/strategy.hpp"
#include "src/messages/conversions.hpp"
#include "src/messages/given_particles_message.hpp"
#include "src/messages/input_checks.hpp"

namespace pf_resampling {
namespace {

// Squared distance that two standard normal numbers have on average.
constexpr double kBelievedDistance = 2.0;
// Squared distance that one counts with that was not believed: far out, for a filter that is right.
constexpr double kUnbelievedDistance = 25.0;
// m: a robot that has just begun has no scene yet.
constexpr double kSmallestScene = 1.0;
// How far a sensor's z axis may be off the robot's: cosine.
constexpr double kUpright = 0.9;

RangeBearingObservation to_observation(const LandmarkObservation& message) {
  return {message.id, message.range, wrap_angle(message.bearing), message.range_variance,
          message.bearing_variance};
}

}  // namespace

FastSlamPipeline::FastSlamPipeline(const FastSlamPipelineOptions& options, FastSlamSinks sinks)
    : options_(options),
      sinks_(std::move(sinks)),
      strategy_(strategy_of(options.filter.strategy)),
      starts_frozen_(options.filter.map.frozen),
      tags_(FramePattern(options.tag_pattern), options.frames),
      filter_(options.filter, static_cast<std::uint64_t>(options.seed)),
      odometry_(options.odometry_input),
      publisher_(options.frames, options.output, &sinks_) {
  for (const auto& [frame, place] : options_.sensors) {
    frames_.add(options_.frames.base, frame, {place.x, place.y, 0.0}, place.heading);
  }
  if (!options_.map_file.empty()) start_map_ = read_map_file(options_.map_file);
  start_filter_anew();
}

void FastSlamPipeline::start_filter_anew() {
  if (options_.filter.map.frozen != starts_frozen_) {  // load_map said otherwise
    options_.filter.map.frozen = starts_frozen_;
    filter_.set_options(options_.filter);
  }
  filter_.reset();
  if (start_map_) filter_.load(*start_map_);
  take_new_belief();
  note_scene_of_map();
}

// ---- messages in ------------------------------------------------------------------------------

void FastSlamPipeline::handle(const nav_msgs::Odometry& message) {
  if (const auto rejection = check(message, options_.frames)) return reject("odom", *rejection);
  const DeadReckoning::Taken taken = odometry_.take(message, options_.filter.odometry);
  if (taken.rejection) return reject("odom", *taken.rejection);
  if (!taken.warning.empty()) {
    const bool anew = taken.began_again && options_.restart_after_jump_back;
    log(LogLevel::warning, taken.warning + (anew ? ", the filter starts anew" : ""));
  }
  if (taken.time_jumped_back) forget_time(taken);
  take_tag_scans();
  process_ready();
  carry_belief_forward();
  publisher_.publish_pose(odometry_.newest(), *estimate(), odometry_.newest_pose());
  publish_pictures(odometry_.newest());
}

void FastSlamPipeline::handle(const LandmarkObservationArray& scan) {
  if (const auto rejection = check(scan)) return reject("landmarks", *rejection);
  if (const auto rejection = odometry_.check_ahead(scan.header.stamp, options_.max_ahead)) {
    return reject("landmarks", *rejection);
  }
  const auto place = std::upper_bound(
      scans_.begin(), scans_.end(), scan.header.stamp,
      [](const ros::Time& stamp, const auto& other) { return stamp < other.header.stamp; });
  scans_.insert(place, scan);
  if (queued() > options_.queue_length) {
    const bool is_late = odometry_.covers(scans_.front().header.stamp);
    reject("landmarks", {is_late ? RejectReason::overload : RejectReason::queue_full,
                         "more than " + std::to_string(options_.queue_length) + " scans wait for " +
                             (is_late ? "computation" : "odometry") + ": the oldest is dropped"});
    scans_.pop_front();
  }
  process_ready();
}

void FastSlamPipeline::handle(const geometry_msgs::PoseWithCovarianceStamped& message) {
  if (const auto rejection = check(message, options_.frames)) {
    return reject("initialpose", *rejection);
  }
  start_about({to_pose2(message.pose.pose), to_covariance3(message.pose.covariance)},
              message.header.stamp);
}

void FastSlamPipeline::handle(const tf2_msgs::TFMessage& message) {
  for (const geometry_msgs::TransformStamped& transform : message.transforms) {
    if (tags_.is_tag(transform)) {
      const ros::Time newest = odometry_.empty() ? ros::Time() : odometry_.newest();
      const auto rejection = tags_.take(transform, newest, &frames_);
      if (rejection) reject("landmarks", *rejection);
      continue;
    }
    // Where the robot is is not ours to learn from tf.
    const std::string child = without_slash(transform.child_frame_id);
    if (child == options_.frames.base || child == options_.frames.odom) continue;
    if (!frames_.add(transform)) {
      reject("tf", {RejectReason::not_finite, "the transform of frame '" + child +
                                                  "' is no rigid motion from another frame"});
    }
  }
  take_tag_scans();
}

// ---- services ---------------------------------------------------------------------------------

void FastSlamPipeline::reset() {
  odometry_.clear();
  forget_time();
  start_filter_anew();
}

std::string FastSlamPipeline::set_particles(const geometry_msgs::PoseArray& poses,
                                            const std::vector<double>& weights) {
  const GivenParticles particles = to_given_particles(poses, weights, options_.frames);
  const ros::Time stamp = stamp_of_given(poses.header.stamp, odometry_);
  filter_.set_particles(particles);
  odometry_.restart_at(stamp, options_.filter.odometry);
  take_new_belief();
  return std::to_string(particles.poses.size()) + " particles set";
}

void FastSlamPipeline::set_parameters(const std::map<std::string, std::string>& values) {
  FastSlamPipelineOptions options = options_;
  try {
    pf_resampling::set_parameters(live_parameters_of(&options), values);
    validate(options.filter);
    filter_.set_options(options.filter);
  } catch (const Error& error) {
    refused_ = error.what();
    throw;
  }
  refused_.clear();
  if (options.filter.map.frozen != options_.filter.map.frozen) {
    starts_frozen_ = options.filter.map.frozen;
  }
  options_.filter = options.filter;
  strategy_ = strategy_of(options_.filter.strategy);
  log(LogLevel::info, "strategy: " + strategy_);
}

// ---- the flow ---------------------------------------------------------------------------------

void FastSlamPipeline::start_about(const PoseEstimate& start, ros::Time stamp) {
  try {
    filter_.set_poses(start);
  } catch (const Error& error) {
    return reject("initialpose", {RejectReason::filter_error, error.what()});
  }
  odometry_.restart_at(stamp, options_.filter.odometry);
  take_new_belief();
}

void FastSlamPipeline::take_tag_scans() {
  const ros::Time newest = odometry_.empty() ? ros::Time() : odometry_.newest();
  for (const LandmarkObservationArray& scan : tags_.take_complete(newest)) handle(scan);
}

void FastSlamPipeline::process_ready() {
  while (!options_.deferred && process_next()) {
  }
}

// The oldest first, as long as there is another to use.
void FastSlamPipeline::drop_late() {
  while (scans_.size() > 1 && !odometry_.empty() && scans_[1].header.stamp <= odometry_.newest() &&
         (odometry_.newest() - scans_.front().header.stamp).toSec() > options_.max_latency) {
    reject("landmarks", {RejectReason::overload,
                         "computation does not keep up: what has waited longer "
                         "than landmark_input/max_latency is dropped"});
    scans_.pop_front();
  }
}

bool FastSlamPipeline::process_next() {
  if (options_.deferred) drop_late();
  while (!scans_.empty() && !odometry_.empty() &&
         scans_.front().header.stamp <= odometry_.newest()) {
    const LandmarkObservationArray scan = scans_.front();
    scans_.pop_front();
    if (const auto rejection = odometry_.check_stamp(scan.header.stamp, 0.0)) {
      reject("landmarks", *rejection);
      continue;
    }
    update(scan);
    return true;
  }
  return false;
}

void FastSlamPipeline::update(const LandmarkObservationArray& scan) {
  const std::optional<Pose2> sensor = sensor_of(scan.header.frame_id);
  if (!sensor) return;
  LatestScan used;
  used.stamp = scan.header.stamp;
  used.sensor = *sensor;
  used.observations = usable_observations(scan);
  if (used.observations.empty()) return;
  const double start = sinks_.stopwatch ? sinks_.stopwatch() : 0.0;
  try {
    filter_.update(odometry_.until(used.stamp, options_.filter.odometry), used.observations,
                   used.sensor);
  } catch (const Error& error) {
    return reject("landmarks", {RejectReason::filter_error, error.what()});
  }
  const double update_time = sinks_.stopwatch ? sinks_.stopwatch() - start : 0.0;

  path_stamps_.push_back(used.stamp);
  odometry_.use_until(used.stamp, options_.filter.odometry);
  belief_ = filter_.estimate();
  const double since_last =
      last_scan_.isZero() ? 0.0 : std::max(0.0, (used.stamp - last_scan_).toSec());
  last_scan_ = used.stamp;
  timing_.add(update_time, used.stamp);
  latency_ = (odometry_.newest() - used.stamp).toSec();
  used.robot = belief_.mean;
  used.outcomes = filter_.outcomes();
  note_outcomes(used, since_last);
  note_scene(used);
  recover(used);
  latest_ = used;
  if (sinks_.updated) sinks_.updated(used.stamp, &filter_);
  publish_status(used.stamp, update_time);
}

std::optional<Pose2> FastSlamPipeline::sensor_of(const std::string& frame) {
  const std::string name = without_slash(frame);
  const auto pose = frames_.pose(options_.frames.base, name);
  if (!pose) {
    reject("landmarks",
           {RejectReason::unknown_frame, "where '" + frame + "' is on '" + options_.frames.base +
                                             "' is not known: give it on /tf_static, or in the "
                                             "list `sensors` of the configuration"});
    return std::nullopt;
  }
  const Eigen::Matrix3d turn = pose->linear();
  if (turn(2, 2) < kUpright) {
    reject("landmarks",
           {RejectReason::wrong_frame, "the z axis of '" + frame + "' does not point up"});
    return std::nullopt;
  }
  return Pose2{pose->translation().x(), pose->translation().y(),
               std::atan2(turn(1, 0), turn(0, 0))};
}

std::vector<RangeBearingObservation> FastSlamPipeline::usable_observations(
    const LandmarkObservationArray& scan) {
  std::vector<RangeBearingObservation> usable;
  for (const LandmarkObservation& observation : scan.observations) {
    if (const auto rejection = check(observation)) {
      reject("landmarks", *rejection);
    } else if (observation.id < 0 && filter_.association() == DataAssociation::known) {
      reject("landmarks", {RejectReason::unknown_id,
                           "an observation has the id " + std::to_string(observation.id) +
                               ", and association/method is known: mutual_exclusion does without "
                               "ids"});
    } else {
      usable.push_back(to_observation(observation));
    }
  }
  return usable;
}

// What the filter did not believe is counted: a misread id, a reflection, or a robot that is lost.
void FastSlamPipeline::note_outcomes(const LatestScan& scan, double duration) {
  for (std::size_t k = 0; k < scan.outcomes.size(); ++k) {
    const ObservationOutcome& outcome = scan.outcomes[k];
    if (outcome.is_new) continue;
    const bool is_believed = outcome.accepted >= 0.5;
    lost_.observe(is_believed ? kBelievedDistance : kUnbelievedDistance, 2, duration);
    duration = 0.0;
    if (is_believed) continue;
    const RangeBearingObservation& z = scan.observations[k];
    rejects_.add("landmarks", RejectReason::gated,
                 rejection(RejectReason::gated, "landmark ", z.id, " seen at ", z.range, " m and ",
                           z.bearing, " rad")
                     .detail);
  }
}

void FastSlamPipeline::note_scene(const LatestScan& scan) {
  const Pose2 sensor = compose(scan.robot, scan.sensor);
  scene_.extend(Eigen::Vector2d(scan.robot.x, scan.robot.y));
  for (std::size_t k = 0; k < scan.outcomes.size(); ++k) {
    if (!scan.outcomes[k].is_new && scan.outcomes[k].accepted < 0.5) continue;
    const RangeBearingObservation& z = scan.observations[k];
    const double direction = sensor.heading + z.bearing;
    scene_.extend(Eigen::Vector2d(sensor.x + z.range * std::cos(direction),
                                  sensor.y + z.range * std::sin(direction)));
  }
}

void FastSlamPipeline::note_scene_of_map() {
  scene_ = Eigen::AlignedBox2d(Eigen::Vector2d(belief_.mean.x, belief_.mean.y));
  for (const LandmarkEstimate& landmark : filter_.map()) scene_.extend(landmark.mean);
}

// A robot that was carried away sees known landmarks where they cannot be; where they all can be,
// it is.
void FastSlamPipeline::recover(const LatestScan& scan) {
  if (!options_.recovers || filter_.association() != DataAssociation::known) return;
  if (fits(scan.outcomes)) return sightings_.clear();
  sightings_.add(scan.stamp, compose(scan.robot, scan.sensor), scan.observations,
                 options_.filter.sensor, &filter_);
  if (!(lost_.probability() > 0.5) || !sightings_.suffice()) return;
  const std::optional<PoseEstimate> found = relocalize(sightings_.all(), belief_.mean);
  if (!found) return;
  log(LogLevel::warning, "lost: the landmarks seen of late fit the map from (" +
                             std::to_string(found->mean.x) + ", " + std::to_string(found->mean.y) +
                             "), where the robot is put");
  filter_.set_poses(*found);
  injected_ += static_cast<std::uint64_t>(filter_.particles().size());
  take_new_belief();
}

// The filter was put elsewhere: what was before says nothing of it.
void FastSlamPipeline::take_new_belief() {
  latest_ = LatestScan{};
  lost_.reset();
  sightings_.clear();
  path_stamps_.clear();
  belief_ = filter_.estimate();
}

// The odometry kept is bounded: without scans the particles move on by odometry alone.
void FastSlamPipeline::carry_belief_forward() {
  const std::optional<ros::Time> stamp = odometry_.overdue();
  if (!stamp) return;
  filter_.update(odometry_.until(*stamp, options_.filter.odometry), {});
  path_stamps_.push_back(*stamp);
  odometry_.use_until(*stamp, options_.filter.odometry);
  belief_ = filter_.estimate();
}

void FastSlamPipeline::forget_time(const DeadReckoning::Taken& jump) {
  if (!scans_.empty()) {
    log(LogLevel::info, std::to_string(scans_.size()) + " waiting scans are dropped");
  }
  scans_.clear();
  tags_.clear();
  latest_ = LatestScan{};
  last_scan_ = ros::Time();
  if (jump.began_again && options_.restart_after_jump_back) return start_filter_anew();
  if (!jump.time_jumped_back) return;
  filter_.update(jump.until_jump, {});
  path_stamps_.push_back(odometry_.newest());
  belief_ = filter_.estimate();
}

double FastSlamPipeline::lost_probability() const {
  const std::optional<PoseEstimate> belief = estimate();
  const PoseEstimate& robot = belief ? *belief : belief_;
  Eigen::AlignedBox2d scene = scene_;
  scene.extend(Eigen::Vector2d(robot.mean.x, robot.mean.y));
  const double extent = std::max(scene.diagonal().norm(), kSmallestScene);
  return either_probability(lost_.probability(),
                            unknown_probability(position_sigma(robot), extent));
}

std::optional<PoseEstimate> FastSlamPipeline::estimate() const {
  if (odometry_.empty()) return std::nullopt;
  return moved_by(belief_, filter_.corrected(odometry_.since()));
}

void FastSlamPipeline::reject(const std::string& input, const Rejection& rejection) {
  if (rejects_.count(input, rejection.reason) == 0) {
    log(LogLevel::warning, input + ": rejected, " + to_string(rejection.reason) + ": " +
                               rejection.detail + " (said once; counted in status)");
  }
  rejects_.add(input, rejection.reason, rejection.detail);
}

void FastSlamPipeline::log(LogLevel level, const std::string& text) const {
  if (sinks_.log) sinks_.log(level, text);
}

}  // namespace pf_resampling
