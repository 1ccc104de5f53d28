#pragma once

// What FilterPipeline does; included where a filter's own pipeline instantiates it.

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/models/lost_error.hpp"
#include "pf_resampling_core/strategy/strategy.hpp"
#include "src/frames/frame_names.hpp"
#include "src/messages/conversions.hpp"
#include "src/odometry/input_checks.hpp"
#include "src/pipeline/filter_pipeline.hpp"
#include "src/pipeline/filter_pipeline_output_impl.hpp"

namespace pf_resampling {

inline constexpr int kMostPlaces = 10;  // that are told apart

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
  if (!is_done) throw Error(std::string(request) + " failed; see the log and /diagnostics");
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
    log(LogLevel::warning, taken.warning + (taken.began_again ? ", the filter is reset" : ""));
  }
  if (taken.time_jumped) forget_time(taken);
  drop_far_ahead();
  if (first_odometry_.isZero()) first_odometry_ = odometry_.newest();
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
  if (is_duplicate(message)) {
    return reject(
        {RejectReason::repeated, "exact duplicate, used once: is there a second publisher?"});
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
bool FilterPipeline<Types>::is_duplicate(const Message& message) const {
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
  used_count_ += group.size();
  const ros::Duration window(simultaneous().value_or(0.0));
  const auto most = static_cast<std::size_t>(options_.queue_length);
  // However many come of one moment.
  while (!used_.empty() &&
         (used_.size() > most || used_.front().header.stamp + window < odometry_.used())) {
    used_.pop_front();
  }
}

// What came before any odometry could not be compared with it, and would keep the place of others.
template <typename Types>
void FilterPipeline<Types>::drop_far_ahead() {
  while (!waiting_.empty()) {
    const auto rejection = odometry_.check_ahead(waiting_.back().header.stamp, options_.max_ahead);
    if (!rejection) return;
    reject(*rejection);
    waiting_.pop_back();
  }
}

template <typename Types>
void FilterPipeline<Types>::drop_oldest() {
  const bool is_late = filter_ && odometry_.covers(waiting_.front().header.stamp);
  const std::string needs = is_late ? "computation" : filter_ ? "odometry" : Types::kNames.needs;
  reject({is_late ? RejectReason::overload : RejectReason::queue_full,
          "more than " + std::to_string(options_.queue_length) + " " + Types::kNames.plural +
              " wait for " + needs + ": the oldest is dropped" +
              (filter_ ? "" : std::string("; ") + Types::kNames.remedy)});
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
    has_motion_on_tf_ = has_motion_on_tf_ || is_odometry;
    if (is_odometry && options_.odometry_input.source == OdometrySource::tf) {
      take_odometry(to_odometry_message(transform));
    }
    if (child == options_.frames.base || child == options_.frames.odom) continue;
    if (!frames_.add(transform)) {
      reject("tf", {RejectReason::not_finite, "the transform of frame '" + child +
                                                  "' is not a rigid motion relative to another "
                                                  "frame"});
    }
  }
  hand_over_observations();
}

template <typename Types>
std::string FilterPipeline<Types>::odometry_elsewhere() const {
  if (!has_motion_on_tf_ || options_.odometry_input.source == OdometrySource::tf) return "";
  return "'" + options_.frames.odom + "' -> '" + options_.frames.base +
         "' on /tf could be it: set odometry_input/source to tf";
}

// ---- the flow ---------------------------------------------------------------------------------

template <typename Types>
void FilterPipeline<Types>::start(std::unique_ptr<Filter> filter) {
  filter_ = std::move(filter);
  forget_observations();
  odometry_.restart_at_oldest(noise());
  take_new_belief();
  if (!pending_start_) return;
  const auto [there, stamp] = *pending_start_;
  pending_start_.reset();
  start_about(there, stamp);
}

template <typename Types>
void FilterPipeline<Types>::start_about(const PoseEstimate& there, ros::Time stamp) {
  try {
    put_robot(there);
  } catch (const Error& error) {
    return reject("initialpose", {RejectReason::filter_error, error.what()});
  }
  odometry_.restart_at(stamp, noise());
  take_new_belief();
  carry_belief_forward();
  log(LogLevel::info, "initial pose taken: the robot is put at (" + number_text(there.mean.x) +
                          ", " + number_text(there.mean.y) + ") m, heading " +
                          number_text(there.mean.heading) + " rad");
}

template <typename Types>
void FilterPipeline<Types>::take_new_belief() {
  places_ = PoseClusters();
  lost_.reset();
  sample_size_.reset();
  descendants_.reset();
  publisher_.clear_path();
  forget_past();
  take_belief();
}

// The oldest first, as long as there is another to use.
template <typename Types>
void FilterPipeline<Types>::drop_late() {
  while (filter_ && waiting_.size() > 1 && is_covered(waiting_[1]) &&
         (odometry_.newest() - waiting_.front().header.stamp).toSec() > options_.max_latency) {
    reject(rejection(RejectReason::overload, "the computer is too slow: ", Types::kNames.plural,
                     " that have waited longer than ", options_.max_latency, " s are dropped"));
    waiting_.pop_front();
  }
}

template <typename Types>
bool FilterPipeline<Types>::process_next() {
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
  const OdometryIncrement motion = odometry_.until(stamp, noise());
  const double start = sinks_.stopwatch ? sinks_.stopwatch() : 0.0;
  try {
    update_filter(motion, *observations);
  } catch (const Error& error) {
    return reject({RejectReason::filter_error, error.what()});
  }
  update_time_ = sinks_.stopwatch ? sinks_.stopwatch() - start : 0.0;

  odometry_.use_until(stamp, noise());
  note_used(group);
  note_step(stamp);
  take_belief();
  timing_.add(update_time_, stamp);
  latency_ = (odometry_.newest() - stamp).toSec();
  const double duration = last_observation_.isZero() ? 0.0 : (stamp - last_observation_).toSec();
  last_observation_ = stamp;
  note_observations(stamp, *observations, std::max(0.0, duration));
  note_health(duration);
  find_places();
  publish_status(stamp);
}

template <typename Types>
void FilterPipeline<Types>::move_on(const OdometryIncrement& motion, ros::Time stamp) {
  update_filter(motion, Observations{});
  note_step(stamp);
  take_belief();
  find_places();
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
  if (jump.began_again) {
    start_anew();
  } else if (filter_ && jump.time_jumped) {
    move_on(jump.until_jump, odometry_.newest());
  }
}

template <typename Types>
double FilterPipeline<Types>::lost_probability() const {
  const std::optional<PoseEstimate> place = place_now();
  if (!place) return 1.0;
  return either_probability(lost_.probability(), position_unknown(*place));
}

template <typename Types>
double FilterPipeline<Types>::position_unknown(const PoseEstimate& place) const {
  return farther_probability(place.covariance.template topLeftCorner<2, 2>(),
                             lost_error(extent(place)), noise_doubt());
}

template <typename Types>
void FilterPipeline<Types>::note_health(double duration) {
  const auto& status = filter_->status();
  const double particles = std::max(1, status.particles);
  sample_size_.add(status.effective_sample_size / particles, duration);
  descendants_.add(status.distinct_ancestors_of_renewal / particles, duration);
}

template <typename Types>
void FilterPipeline<Types>::find_places() {
  const bool is_wanted =
      (sinks_.status || sinks_.markers) && (!sinks_.wants_hypotheses || sinks_.wants_hypotheses());
  const auto& particles = filter_->particles();
  places_ = is_wanted && belief_ ? pose_clusters(particles.weight, particles.x, particles.y,
                                                 particles.heading, kMostPlaces)
                                 : PoseClusters();
}

template <typename Types>
HealthJudgement FilterPipeline<Types>::health() const {
  HealthInputs inputs;
  inputs.observations = Types::kNames.plural;
  if (const std::optional<PoseEstimate> place = place_now()) {
    inputs.lost = lost_.probability();
    inputs.position_unknown = position_unknown(*place);
    inputs.heading_unknown = unknown_heading_probability(heading_sigma(*place));
    inputs.sample_size = sample_size_.value();
    inputs.descendants = descendants_.value();
    const auto& status = filter_->status();
    inputs.histories =
        static_cast<double>(status.distinct_ancestors_since_start) / std::max(1, status.particles);
    inputs.keeps_up = timing_.keeps_up();
    for (const Finding& finding : findings()) {
      (is_of_landmark(finding) ? inputs.map_is_wrong : inputs.odometry_is_wrong) |= finding.is_open;
    }
    add_health(&inputs);
  } else {
    inputs.has_belief = false;
    inputs.waits_for = waits_for();
    inputs.remedy = filter_ ? "/diagnostics says why, if nothing comes."
                            : std::string("Provide them: ") + Types::kNames.remedy + ".";
  }
  return judge_health(inputs);
}

template <typename Types>
void FilterPipeline<Types>::reject(const std::string& input, const Rejection& rejection) {
  const std::string detail = shown_detail(rejection.detail);
  if (rejects_.count(input, rejection.reason) == 0) {
    log(LogLevel::warning, input + ": rejected, " + to_string(rejection.reason) + ": " + detail +
                               " (logged once; status counts them)");
  }
  rejects_.add(input, rejection.reason, detail);
}

template <typename Types>
std::string FilterPipeline<Types>::why_none_used() const {
  const std::string plural = Types::kNames.plural;
  std::string why;
  const auto add = [&](const std::string& reason) { why += (why.empty() ? "" : "; ") + reason; };
  for (const std::string& line : lines_of(rejects_)) add(line);
  if (odometry_.empty() && !odometry_elsewhere().empty()) add(odometry_elsewhere());
  if (!why.empty()) return why;
  if (!filter_) return "it waits for " + waits_for();
  if (odometry_.empty()) return "there is no odometry";
  return waiting_.empty() ? "there are no " + plural
                          : std::to_string(queued()) + " " + plural + " wait for odometry";
}

// ---- services ---------------------------------------------------------------------------------

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
  return basic_first(std::move(parameters));
}

// Values on the parameter server stay there when a node ends, and are given to the next one.
template <typename Types>
void FilterPipeline<Types>::note_preset() const {
  auto filter = options_.filter;
  const std::string departures =
      departures_from(preset_named(Types::presets(), options_.preset), parameters_of(&filter));
  if (departures.empty()) return;
  log(LogLevel::info, "set by you, so not as in the preset: " + departures);
}

template <typename Types>
std::optional<typename Types::Checkpoint> FilterPipeline<Types>::checkpoint() {
  if (!belief_ || odometry_.empty()) return std::nullopt;
  Checkpoint checkpoint;
  save_filter(&checkpoint);
  odometry_.save(&checkpoint.progress);
  checkpoint.progress.last_observation = last_observation_;
  checkpoint.progress.lost_probability = lost_.probability();
  checkpoint.progress.normalized_innovation = lost_.normalized_innovation();
  return checkpoint;
}

template <typename Types>
void FilterPipeline<Types>::resume(const Checkpoint& checkpoint) {
  const SavedProgress& progress = checkpoint.progress;
  load_filter(checkpoint);
  pending_start_.reset();
  waiting_.clear();
  used_.clear();
  forget_observations();
  reported_weight_resets_ = 0;
  odometry_.resume(progress, noise());
  last_observation_ = progress.last_observation;
  take_new_belief();
  lost_.resume(progress.lost_probability, progress.normalized_innovation);
}

}  // namespace pf_resampling
