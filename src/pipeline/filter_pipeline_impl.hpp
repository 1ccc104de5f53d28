#pragma once

// What FilterPipeline does; included where a filter's own pipeline instantiates it.

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/strategy/strategy.hpp"
#include "src/frames/frame_names.hpp"
#include "src/messages/conversions.hpp"
#include "src/messages/given_particles_message.hpp"
#include "src/messages/input_checks.hpp"
#include "src/pictures/markers.hpp"
#include "src/pipeline/filter_pipeline.hpp"

namespace pf_resampling {

// A robot stands still when its odometry has read the same for so long, but for so little.
inline constexpr double kStandsAfter = 1.0;    // s
inline constexpr double kRestPosition = 0.01;  // m
inline constexpr double kRestHeading = 0.01;   // rad
// Places that are told apart, and how often, s, among how many particles: that takes longer than an
// update then.
inline constexpr int kMostPlaces = 10;
inline constexpr double kPlacesPeriod = 0.5;  // s
inline constexpr Eigen::Index kManyParticles = 10000;

template <typename Types>
FilterPipeline<Types>::FilterPipeline(const Options& options, const PipelineSinks& sinks)
    : options_(options),
      sinks_(sinks),
      odometry_(options.odometry_input),
      imu_heading_(options.odometry_input.imu_heading),
      publisher_(options.frames, options.output, &sinks_),
      strategy_(strategy_of(options.filter.strategy)) {
  validate(options_.filter);
  note_preset();
}

// ---- the way in --------------------------------------------------------------------------------

template <typename Types>
bool FilterPipeline<Types>::guard(const char* input, const std::function<void()>& work) {
  try {
    work();
    return true;
  } catch (const std::exception& exception) {
    note_exception(input, exception.what());
  } catch (...) {
    note_exception(input, "an exception of unknown type");
  }
  return false;
}

template <typename Types>
std::string FilterPipeline<Types>::ask(const char* request,
                                       const std::function<std::string()>& work) {
  std::string answer;
  std::exception_ptr refusal;
  const bool is_done = guard(request, [&] {
    try {
      answer = work();
    } catch (const Error&) {
      refusal = std::current_exception();
    }
  });
  if (refusal) std::rethrow_exception(refusal);
  if (!is_done) throw Error(std::string(request) + " failed; the log and /diagnostics say why");
  return answer;
}

// Where it happened is unknown: the motion may not have been used. What the filter holds is the
// last belief, brought to the newest odometry if that can be done.
template <typename Types>
void FilterPipeline<Types>::note_exception(const char* input, const char* what) noexcept {
  try {
    reject(input, {RejectReason::exception, what});
  } catch (...) {  // no memory for the words: the pose matters more
  }
  try {
    if (odometry_.empty()) return;
    if (filter_ && belief_) move_on(odometry_.since(), odometry_.newest());
    odometry_.restart_at(odometry_.newest(), noise());
  } catch (...) {
    odometry_.clear();
  }
}

// ---- messages in ------------------------------------------------------------------------------

template <typename Types>
void FilterPipeline<Types>::handle(const nav_msgs::Odometry& message) {
  if (options_.odometry_input.source == OdometrySource::topic) take_odometry(message);
}

template <typename Types>
void FilterPipeline<Types>::handle(const sensor_msgs::Imu& message) {
  if (const auto rejection = imu_heading_.take(message, options_.frames.base, frames_)) {
    reject("imu", *rejection);
  }
}

template <typename Types>
void FilterPipeline<Types>::take_odometry(const nav_msgs::Odometry& message) {
  if (const auto rejection = check(message, options_.frames)) return reject("odom", *rejection);
  const DeadReckoning::Taken taken =
      odometry_.take(message, noise(), imu_heading_.at(message.header.stamp));
  if (taken.rejection) return reject("odom", *taken.rejection);
  if (!taken.warning.empty()) {
    const bool anew = taken.began_again && options_.restart_after_jump_back;
    log(LogLevel::warning, taken.warning + (anew ? ", the filter starts from nothing" : ""));
  }
  if (taken.time_jumped) forget_time(taken);
  note_reading();
  take_offered_pose();
  hand_over_observations();
  process_ready();
  carry_belief_forward();
  if (const auto belief = estimate()) {
    publisher_.publish_pose(odometry_.newest(), *belief, odometry_.newest_pose());
  }
  publish_pictures(odometry_.newest());
}

template <typename Types>
void FilterPipeline<Types>::handle(const Message& message) {
  if (const auto rejection = fault_in(message)) return reject(*rejection);
  const ros::Time stamp = message.header.stamp;
  if (const auto rejection = odometry_.check_ahead(stamp, options_.max_ahead)) {
    return reject(*rejection);
  }
  if (came_before(message)) {
    return reject({RejectReason::repeated,
                   "the same came before, and counts once: does something "
                   "else publish it, too?"});
  }
  const auto place = std::upper_bound(
      waiting_.begin(), waiting_.end(), stamp,
      [](const ros::Time& earlier, const Message& other) { return earlier < other.header.stamp; });
  waiting_.insert(place, message);
  if (queued() > options_.queue_length) drop_oldest();
  process_ready();
}

// Twice the same would count as two measurements, and make a belief that is too sure.
template <typename Types>
bool FilterPipeline<Types>::came_before(const Message& message) const {
  Message wanted = message;
  const auto is_same = [&](const Message& other) {
    if (other.header.stamp != message.header.stamp) return false;
    wanted.header.seq = other.header.seq;  // of the publisher
    return other == wanted;
  };
  return std::any_of(waiting_.begin(), waiting_.end(), is_same) ||
         std::any_of(used_.begin(), used_.end(), is_same);
}

template <typename Types>
void FilterPipeline<Types>::note_used(const std::vector<Message>& group) {
  used_.insert(used_.end(), group.begin(), group.end());
  const ros::Duration window(simultaneous().value_or(0.0));
  while (used_.front().header.stamp + window < odometry_.used()) used_.pop_front();
}

template <typename Types>
void FilterPipeline<Types>::drop_oldest() {
  const bool is_late = filter_ && odometry_.covers(waiting_.front().header.stamp);
  const std::string needs = is_late ? "computation" : filter_ ? "odometry" : Types::kNames.needs;
  reject({is_late ? RejectReason::overload : RejectReason::queue_full,
          "more than " + std::to_string(options_.queue_length) + " " + Types::kNames.plural +
              " wait for " + needs + ": the oldest is dropped"});
  waiting_.pop_front();
}

template <typename Types>
void FilterPipeline<Types>::handle(const geometry_msgs::PoseWithCovarianceStamped& message) {
  if (const auto rejection = check(message, options_.frames)) {
    return reject("initialpose", *rejection);
  }
  const PoseEstimate there = {to_pose2(message.pose.pose), to_covariance3(message.pose.covariance)};
  if (filter_) {
    start_about(there, message.header.stamp);
  } else {
    pending_start_ = {there, message.header.stamp};
  }
}

template <typename Types>
void FilterPipeline<Types>::handle(const tf2_msgs::TFMessage& message) {
  for (const geometry_msgs::TransformStamped& transform : message.transforms) {
    if (take_transform(transform)) continue;
    // Where the robot is comes from odometry and from this filter, not from tf.
    const std::string child = without_slash(transform.child_frame_id);
    const bool is_odometry =
        child == without_slash(options_.frames.base) &&
        without_slash(transform.header.frame_id) == without_slash(options_.frames.odom);
    if (is_odometry && options_.odometry_input.source == OdometrySource::tf) {
      take_odometry(to_odometry_message(transform));
    }
    if (child == options_.frames.base || child == options_.frames.odom) continue;
    if (child.size() > kLongestFrameName) {
      reject("tf", {RejectReason::unknown_frame,
                    "the name of frame '" + shown_name(child) + "' is too long"});
    } else if (!frames_.add(transform)) {
      reject("tf",
             {RejectReason::not_finite, "the transform of frame '" + child +
                                            "' is not a rigid motion relative to another frame, "
                                            "or one of more frames than any robot has"});
    }
  }
  hand_over_observations();
}

// ---- services ---------------------------------------------------------------------------------

template <typename Types>
void FilterPipeline<Types>::reset() {
  odometry_.clear();
  imu_heading_.clear();
  forget_time({});
  start_anew();
}

template <typename Types>
std::string FilterPipeline<Types>::set_particles(const geometry_msgs::PoseArray& poses,
                                                 const std::vector<double>& weights) {
  const GivenParticles particles = to_given_particles(poses, weights, options_.frames);
  if (!filter_) {
    throw Error(std::string("set_particles: ") + Types::kNames.needs +
                " are not known yet; give them on the topic or in the configuration first");
  }
  const ros::Time stamp = stamp_of_given(poses.header.stamp, odometry_);
  filter_->set_particles(particles);
  odometry_.restart_at(stamp, noise());
  take_new_belief();
  carry_belief_forward();
  return std::to_string(particles.poses.size()) + " particles set";
}

template <typename Types>
void FilterPipeline<Types>::set_parameters(const std::map<std::string, std::string>& values) {
  Options options = options_;
  try {
    const ParameterList parameters = live_parameters(&options);
    const auto preset = values.find("preset");
    // Clients may send all parameters with one changed; alone, a preset is chosen anew.
    const bool is_chosen =
        preset != values.end() && (preset->second != options_.preset || values.size() == 1);
    std::map<std::string, std::string> others = values;
    if (is_chosen) {
      const bool sends_all = values.size() == parameters.size();
      for (const Parameter& parameter : parameters) {
        const auto value = others.find(parameter.name);
        if (sends_all && value != others.end() && value->second == parameter.get()) {
          others.erase(value);
        }
      }
      set_parameter(parameters, "preset", preset->second);
      decltype(options.filter) defaults;
      apply_preset(preset_named(Types::presets(), options.preset), Types::presets(),
                   parameters_of(&defaults), options.given, parameters);
    }
    pf_resampling::set_parameters(parameters, others);
    validate(options.filter);
    if (filter_) filter_->set_options(options.filter);
    refused_.clear();
    options_ = options;
    if (is_chosen) {
      log(LogLevel::info, "preset: " + options_.preset);
      note_preset();
    }
  } catch (const Error& error) {
    refused_ = error.what();
    throw;
  }
  strategy_ = strategy_of(options_.filter.strategy);
  log(LogLevel::info, "strategy: " + strategy_);
}

template <typename Types>
ParameterList FilterPipeline<Types>::live_parameters(Options* options) {
  ParameterList parameters = {preset_parameter(Types::presets(), &options->preset)};
  for (Parameter& parameter : parameters_of(&options->filter)) {
    parameters.push_back(std::move(parameter));
  }
  return parameters;
}

// Values on the parameter server stay there when a node ends, and are given to the next one.
template <typename Types>
void FilterPipeline<Types>::note_preset() const {
  auto filter = options_.filter;
  const std::string departures =
      departures_from(preset_named(Types::presets(), options_.preset), parameters_of(&filter));
  if (departures.empty()) return;
  log(LogLevel::info, "not as in the preset, since it was set otherwise: " + departures);
}

template <typename Types>
std::optional<typename Types::Checkpoint> FilterPipeline<Types>::checkpoint() {
  if (!belief_ || odometry_.empty()) return std::nullopt;
  Checkpoint checkpoint;
  save_filter(&checkpoint);
  odometry_.save(&checkpoint.progress);
  checkpoint.progress.last_observation = static_cast<std::int64_t>(last_observation_.toNSec());
  checkpoint.progress.lost_probability = lost_.probability();
  checkpoint.progress.normalized_innovation = lost_.normalized_innovation();
  return checkpoint;
}

template <typename Types>
void FilterPipeline<Types>::resume(const Checkpoint& checkpoint) {
  const SavedProgress& progress = checkpoint.progress;
  const std::string fault = fault_of(progress);
  if (!fault.empty()) throw Error("checkpoint: " + fault + "; start without it");
  load_filter(checkpoint);
  pending_start_.reset();
  refuse_offered_pose("a checkpoint says more");
  waiting_.clear();
  used_.clear();
  forget_observations();
  reported_weight_resets_ = 0;
  odometry_.resume(progress, noise());
  last_observation_.fromNSec(static_cast<std::uint64_t>(progress.last_observation));
  take_new_belief();
  lost_.resume(progress.lost_probability, progress.normalized_innovation);
}

// ---- the pose of an earlier run ---------------------------------------------------------------

template <typename Types>
std::optional<SavedPose> FilterPipeline<Types>::pose_to_save() const {
  const std::optional<PoseEstimate> belief = estimate();
  if (!belief) return std::nullopt;
  SavedPose saved;
  saved.frame = options_.frames.map;
  saved.map = lasting_map();
  if (saved.map.empty()) return std::nullopt;
  saved.stamp = static_cast<std::int64_t>(odometry_.newest().toNSec());
  saved.pose = *belief;
  saved.pose.covariance = 0.5 * (belief->covariance + belief->covariance.transpose());
  saved.odometry = odometry_.newest_pose();
  saved.stood_still = (odometry_.newest() - rest_.stamp).toSec() >= kStandsAfter;
  saved.lost = lost_probability();
  return saved;
}

template <typename Types>
void FilterPipeline<Types>::offer_pose(const SavedPose& pose, const std::string& file) {
  offered_pose_ = {pose, file};
  offer_ = "the saved pose waits for odometry";
}

template <typename Types>
void FilterPipeline<Types>::note_reading() {
  const StampedOdometry now = {odometry_.newest(), odometry_.newest_pose(), {}, {}};
  if (!first_reading_) {
    first_reading_ = rest_ = now;
  } else if (std::hypot(now.pose.x - rest_.pose.x, now.pose.y - rest_.pose.y) > kRestPosition ||
             std::abs(wrap_angle(now.pose.heading - rest_.pose.heading)) > kRestHeading ||
             now.stamp < rest_.stamp) {
    rest_ = now;
  }
}

// What the odometry read first counts, however long the filter waits for its map.
template <typename Types>
void FilterPipeline<Types>::take_offered_pose() {
  if (!offered_pose_ || !filter_ || !first_reading_) return;
  const auto [saved, file] = *offered_pose_;
  PoseAtStart now;
  now.frame = options_.frames.map;
  now.map = lasting_map();
  now.stamp = static_cast<std::int64_t>(first_reading_->stamp.toNSec());
  now.odometry = first_reading_->pose;
  now.oldest = options_.saved_pose.oldest;
  if (const auto reason = reason_against(saved, now)) return refuse_offered_pose(*reason);
  const double age = 1e-9 * static_cast<double>(now.stamp - saved.stamp);
  const auto offered = std::exchange(offered_pose_, std::nullopt);
  try {
    put_at(pose_at_start(saved, now.odometry), first_reading_->stamp,
           "pose of " + file + " taken, " + number_text(age) + " s old");
    offer_ = "the saved pose was taken";
  } catch (const Error& error) {
    offered_pose_ = offered;
    refuse_offered_pose(error.what());
  }
}

template <typename Types>
void FilterPipeline<Types>::refuse_offered_pose(const std::string& reason) {
  if (!offered_pose_) return;
  offer_ = "the saved pose was not taken: " + reason;
  log(LogLevel::warning, "the pose of " + offered_pose_->second + " is not taken: " + reason);
  offered_pose_.reset();
}

// ---- the flow ---------------------------------------------------------------------------------

template <typename Types>
void FilterPipeline<Types>::start(std::unique_ptr<Filter> filter) {
  filter_ = std::move(filter);
  forget_observations();
  odometry_.restart_at_oldest(noise());
  const auto offered = std::exchange(offered_pose_, std::nullopt);
  take_new_belief();
  offered_pose_ = offered;
  if (!pending_start_) return take_offered_pose();
  const auto [there, stamp] = *pending_start_;
  pending_start_.reset();
  start_about(there, stamp);
}

template <typename Types>
void FilterPipeline<Types>::start_about(const PoseEstimate& there, ros::Time stamp) {
  try {
    put_at(there, stamp, "initial pose taken");
  } catch (const Error& error) {
    reject("initialpose", {RejectReason::filter_error, error.what()});
  }
}

template <typename Types>
void FilterPipeline<Types>::put_at(const PoseEstimate& there, ros::Time stamp,
                                   const std::string& taken) {
  put_robot(there);
  odometry_.restart_at(stamp, noise());
  take_new_belief();
  carry_belief_forward();
  log(LogLevel::info, taken + ": the robot is put at (" + number_text(there.mean.x) + ", " +
                          number_text(there.mean.y) + ") m, heading " +
                          number_text(there.mean.heading) + " rad");
}

template <typename Types>
void FilterPipeline<Types>::start_anew() {
  if (filter_) restart_filter();
  take_new_belief();
}

template <typename Types>
void FilterPipeline<Types>::take_new_belief() {
  refuse_offered_pose("another start was asked for before the first odometry");
  places_ = PoseClusters();
  lost_.reset();
  sample_size_.reset();
  descendants_.reset();
  publisher_.clear_path();
  forget_past();
  take_belief();
}

template <typename Types>
void FilterPipeline<Types>::take_belief() {
  belief_ = filter_ ? belief_of_filter() : std::nullopt;
}

template <typename Types>
void FilterPipeline<Types>::process_ready() {
  while (!options_.deferred && process_next()) {
  }
}

template <typename Types>
bool FilterPipeline<Types>::is_covered(const Message& message) const {
  return !odometry_.empty() && message.header.stamp <= odometry_.newest();
}

// The oldest first, as long as there is another to use.
template <typename Types>
void FilterPipeline<Types>::drop_late() {
  while (waiting_.size() > 1 && is_covered(waiting_[1]) &&
         (odometry_.newest() - waiting_.front().header.stamp).toSec() > options_.max_latency) {
    reject(
        {RejectReason::overload,
         std::string("computation does not keep up: observations that have waited longer than ") +
             Types::kNames.parameters + "/max_latency are dropped"});
    waiting_.pop_front();
  }
}

template <typename Types>
bool FilterPipeline<Types>::process_next() {
  if (take_up_work()) take_belief();
  if (options_.deferred) drop_late();
  const std::optional<double> together = simultaneous();
  while (filter_ && !waiting_.empty() && is_covered(waiting_.front())) {
    const ros::Time first = waiting_.front().header.stamp;
    std::vector<Message> group = {waiting_.front()};
    waiting_.pop_front();
    if (const auto rejection = odometry_.check_stamp(first, together.value_or(0.0))) {
      reject(*rejection);
      continue;
    }
    while (together && !waiting_.empty() && is_covered(waiting_.front()) &&
           waiting_.front().header.stamp - first <= ros::Duration(*together)) {
      group.push_back(waiting_.front());
      waiting_.pop_front();
    }
    update(group);
    return true;
  }
  return false;
}

template <typename Types>
void FilterPipeline<Types>::update(const std::vector<Message>& group) {
  const std::optional<Observations> observations = to_observations(group);
  if (!observations) return;
  const ros::Time stamp = std::max(group.back().header.stamp, odometry_.used());
  const double start = sinks_.stopwatch ? sinks_.stopwatch() : 0.0;
  try {
    update_filter(odometry_.until(stamp, noise()), *observations);
  } catch (const Error& error) {
    return reject({RejectReason::filter_error, error.what()});
  }
  const double update_time = sinks_.stopwatch ? sinks_.stopwatch() - start : 0.0;

  odometry_.use_until(stamp, noise());
  note_used(group);
  note_step(stamp);
  take_belief();
  timing_.add(update_time, stamp);
  latency_ = (odometry_.newest() - stamp).toSec();
  const double duration = last_observation_.isZero() ? 0.0 : (stamp - last_observation_).toSec();
  last_observation_ = stamp;
  note_observations(stamp, *observations, std::max(0.0, duration));
  note_health(duration);
  find_places(stamp);
  publish_status(stamp, update_time);
}

template <typename Types>
void FilterPipeline<Types>::move_on(const OdometryIncrement& motion, ros::Time stamp) {
  update_filter(motion, Observations{});
  note_step(stamp);
  take_belief();
}

// The odometry kept is bounded: without observations the particles move on by odometry alone, and
// while there are none it is given up.
template <typename Types>
void FilterPipeline<Types>::carry_belief_forward() {
  const std::optional<ros::Time> stamp = odometry_.overdue();
  if (!stamp) return;
  if (filter_) move_on(odometry_.until(*stamp, noise()), *stamp);
  odometry_.use_until(*stamp, noise());
}

template <typename Types>
void FilterPipeline<Types>::forget_time(const DeadReckoning::Taken& jump) {
  if (!waiting_.empty()) {
    log(LogLevel::info,
        std::to_string(waiting_.size()) + " waiting " + Types::kNames.plural + " are dropped");
  }
  waiting_.clear();
  used_.clear();
  if (jump.time_jumped) imu_heading_.clear();
  forget_observations();
  last_observation_ = ros::Time();
  publisher_.clear_path();
  if (jump.began_again && options_.restart_after_jump_back) {
    start_anew();
  } else if (filter_ && jump.time_jumped) {
    move_on(jump.until_jump, odometry_.newest());
  }
}

template <typename Types>
std::optional<PoseEstimate> FilterPipeline<Types>::estimate() const {
  if (!belief_ || odometry_.empty()) return std::nullopt;
  return moved_by(*belief_, motion_since_update());
}

template <typename Types>
double FilterPipeline<Types>::lost_probability() const {
  const std::optional<PoseEstimate> belief = estimate();
  if (!belief) return 1.0;
  return either_probability(lost_.probability(),
                            unknown_probability(position_sigma(*belief), extent(*belief)));
}

template <typename Types>
void FilterPipeline<Types>::note_health(double duration) {
  const auto& status = filter_->status();
  const double particles = std::max(1, status.particles);
  sample_size_.add(status.effective_sample_size / particles, duration);
  descendants_.add(status.distinct_ancestors_of_renewal / particles, duration);
}

template <typename Types>
void FilterPipeline<Types>::find_places(ros::Time stamp) {
  if ((!sinks_.status && !sinks_.markers) ||
      (sinks_.wants_hypotheses && !sinks_.wants_hypotheses())) {
    places_ = PoseClusters();
    return;
  }
  const auto& particles = filter_->particles();
  if (particles.size() > kManyParticles && !is_due(kPlacesPeriod, stamp, &last_places_)) return;
  places_ = belief_ ? pose_clusters(particles.weight, particles.x, particles.y, particles.heading,
                                    kMostPlaces)
                    : PoseClusters();
}

template <typename Types>
HealthJudgement FilterPipeline<Types>::health() const {
  HealthInputs inputs;
  inputs.observations = Types::kNames.plural;
  if (const std::optional<PoseEstimate> belief = estimate()) {
    inputs.lost = lost_.probability();
    inputs.position_unknown = unknown_probability(position_sigma(*belief), extent(*belief));
    inputs.heading_unknown = unknown_heading_probability(heading_sigma(*belief));
    inputs.sample_size = sample_size_.value();
    inputs.descendants = descendants_.value();
    const auto& status = filter_->status();
    inputs.histories =
        static_cast<double>(status.distinct_ancestors_since_start) / std::max(1, status.particles);
    inputs.keeps_up = timing_.keeps_up();
    add_health(&inputs);
  } else {
    inputs.has_belief = false;
    inputs.waits_for = waits_for();
  }
  return judge_health(inputs);
}

template <typename Types>
void FilterPipeline<Types>::reject(const std::string& input, const Rejection& rejection) {
  if (rejects_.count(input, rejection.reason) == 0) {
    log(LogLevel::warning, input + ": rejected, " + to_string(rejection.reason) + ": " +
                               rejection.detail + " (logged once; status counts them)");
  }
  rejects_.add(input, rejection.reason, rejection.detail);
}

template <typename Types>
void FilterPipeline<Types>::log(LogLevel level, const std::string& text) const {
  if (sinks_.log) sinks_.log(level, text);
}

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
    add_hypotheses(stamp, &array);
    publisher_.publish_markers(array);
  }
  publish_path(stamp);
  report_silence(stamp);
}

template <typename Types>
void FilterPipeline<Types>::add_hypotheses(ros::Time stamp,
                                           visualization_msgs::MarkerArray* markers) {
  const std::optional<PoseEstimate> belief = estimate();
  if (!belief) return;
  PoseClusters now = places_;
  for (PoseCluster& place : now.clusters) {
    place.pose.mean = compose(place.pose.mean, motion_since_update().mean);
  }
  const double size = extent(*belief);
  const visualization_msgs::MarkerArray more =
      hypothesis_markers({options_.frames.map, stamp}, now, std::clamp(0.003 * size, 0.01, 0.4),
                         std::clamp(0.025 * size, 0.1, 5.0), &shown_places_);
  markers->markers.insert(markers->markers.end(), more.markers.begin(), more.markers.end());
}

template <typename Types>
void FilterPipeline<Types>::publish_status(ros::Time stamp, double update_time) {
  if (!sinks_.status) return;
  FilterStatus message = to_message(filter_->status());
  message.header.stamp = stamp;
  message.header.frame_id = options_.frames.map;
  message.strategy = strategy_;
  message.refused = refused_;
  message.update_time = update_time;
  message.latency = latency_;
  const HealthJudgement judgement = health();
  message.health = to_string(judgement.health);
  const std::string places = sentence_of(places_);
  message.health_text = sentence_of(judgement) + (places.empty() ? "" : " " + places + ".");
  message.hypotheses = to_hypotheses(places_);
  message.other_weight = places_.rest;
  message.lost = lost_probability();
  message.normalized_innovation = lost_.normalized_innovation();
  message.queued = static_cast<std::uint32_t>(waiting_.size());
  message.rejects = to_messages(rejects_);
  fill_in(&message);
  publisher_.publish_status(message);
}

template <typename Types>
void FilterPipeline<Types>::report_silence(ros::Time now) {
  if (const auto rejection = check(now)) return reject("clock", *rejection);
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
  if (publisher_.held_back() > 0) {
    worsen(DiagnosticStatus::ERROR, "messages with NaN or infinity were not published", &entry);
  }
  add_value("messages not published", std::to_string(publisher_.held_back()), &entry);
  if (entry.message.empty()) entry.message = "fine";
  return entry;
}

}  // namespace pf_resampling
