#pragma once

#include <dynamic_reconfigure/ConfigDescription.h>
#include <dynamic_reconfigure/Reconfigure.h>
#include <gtest/gtest.h>
#include <ros/ros.h>

#include <atomic>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace pf_resampling {

/// What a strategy consists of and what it can be set to.
struct StrategyParameter {
  std::string name;
  std::vector<std::string> choices;
  std::string present;
};

namespace strategies {

inline bool is_strategy(const std::string& name) {
  for (const char* strategy :
       {"population/schedule", "population/renewal", "population/resampling/scheme",
        "population/resampling/inner_scheme", "population/resampling/weights_after",
        "population/compensation/pairing", "population/compensation/covariance",
        "population/compensation/weights_after", "excitation/method"}) {
    if (name == strategy) return true;
  }
  return false;
}

// The values in "'value': 'systematic'" of the Python expression that says what can be chosen.
inline std::vector<std::string> choices_of(const std::string& edit_method) {
  const std::string key = "'value': '";
  std::vector<std::string> choices;
  for (std::size_t at = edit_method.find(key); at != std::string::npos;
       at = edit_method.find(key, at)) {
    at += key.size();
    choices.push_back(edit_method.substr(at, edit_method.find('\'', at) - at));
  }
  return choices;
}

}  // namespace strategies

/// All of them, as a running filter describes them. `filter`: name of its node.
inline std::vector<StrategyParameter> strategy_parameters(const std::string& filter) {
  const auto descriptions = ros::topic::waitForMessage<dynamic_reconfigure::ConfigDescription>(
      filter + "/parameter_descriptions", ros::Duration(30.0));
  if (!descriptions) throw std::runtime_error(filter + " describes no parameters");
  std::vector<StrategyParameter> found;
  for (const auto& group : descriptions->groups) {
    for (const auto& parameter : group.parameters) {
      if (!strategies::is_strategy(parameter.name)) continue;
      found.push_back({parameter.name, strategies::choices_of(parameter.edit_method), ""});
      for (const auto& entry : descriptions->dflt.strs) {
        if (entry.name == parameter.name) found.back().present = entry.value;
      }
    }
  }
  return found;
}

/// Switches a running filter through every choice of every strategy, over and over, from a thread
/// of its own; as a client of dynamic_reconfigure, so as a user would.
class StrategySwitcher {
 public:
  /// `filter`: name of its node; `period`: s of wall time between switches.
  StrategySwitcher(const std::string& filter, double period) : filter_(filter), period_(period) {
    for (const StrategyParameter& parameter : strategy_parameters(filter)) {
      for (const std::string& choice : parameter.choices) {
        switches_.push_back({parameter.name, choice});
      }
      // Back to what it was, so that what depends on it has its turn too.
      switches_.push_back({parameter.name, parameter.present});
    }
    thread_ = std::thread([this] { run(); });
  }

  /// Ends switching. Returns how often each choice was taken over; refused ones are failures.
  int stop() {
    stopped_ = true;
    thread_.join();
    EXPECT_EQ(refused_, "");
    EXPECT_GE(switches_.size(), 25u) << "strategies are missing";
    return done_ / static_cast<int>(switches_.size());
  }

 private:
  struct Switch {
    std::string parameter, choice;
  };

  void run() {
    while (!stopped_) {
      for (const Switch& next : switches_) {
        if (stopped_) return;
        dynamic_reconfigure::Reconfigure call;
        dynamic_reconfigure::StrParameter value;
        value.name = next.parameter;
        value.value = next.choice;
        call.request.config.strs.push_back(value);
        const bool answered = ros::service::call(filter_ + "/set_parameters", call);
        bool taken = false;
        for (const auto& entry : call.response.config.strs) {
          taken = taken || (entry.name == next.parameter && entry.value == next.choice);
        }
        if (!answered || !taken) refused_ += next.parameter + "=" + next.choice + " ";
        ++done_;
        ros::WallDuration(period_).sleep();
      }
    }
  }

  std::string filter_;
  double period_;
  std::vector<Switch> switches_;
  std::string refused_;
  int done_ = 0;
  std::atomic<bool> stopped_{false};
  std::thread thread_;
};

}  // namespace pf_resampling
