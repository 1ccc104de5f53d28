#pragma once

// What FilterPipeline is asked for; part of filter_pipeline_impl.hpp.

#include <cmath>
#include <utility>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/strategy/strategy.hpp"
#include "src/pipeline/filter_pipeline.hpp"

namespace pf_resampling {

// A robot stands still when its odometry has read the same for so long, but for so little.
inline constexpr double kStandsAfter = 1.0;    // s
inline constexpr double kRestPosition = 0.01;  // m
inline constexpr double kRestHeading = 0.01;   // rad

// ---- services ---------------------------------------------------------------------------------

template <typename Types>
void FilterPipeline<Types>::reset() {
  odometry_.clear();
  imu_heading_.clear();
  forget_time({});
  start_anew();
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
  offered_pose_ = OfferedPose{pose, file};
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
  log(LogLevel::warning, "the pose of " + offered_pose_->file + " is not taken: " + reason);
  offered_pose_.reset();
}

}  // namespace pf_resampling
