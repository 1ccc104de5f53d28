#pragma once

// What FilterPipeline is asked for; part of filter_pipeline_impl.hpp.

#include <cmath>
#include <utility>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/strategy/strategy.hpp"
#include "src/pipeline/filter_pipeline.hpp"

namespace pf_resampling {

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
