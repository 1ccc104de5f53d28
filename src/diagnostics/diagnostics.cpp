#include "src/diagnostics/diagnostics.hpp"

#include <cstdio>

namespace pf_resampling {
namespace {

using diagnostic_msgs::DiagnosticStatus;

// Without observations for so long, dead reckoning is all there is.
constexpr double kLongSilence = 5.0;  // s
// Weight of a new update in running means.
constexpr double kTimingRate = 0.1;

}  // namespace

DiagnosticStatus make_diagnostic(const std::string& name) {
  DiagnosticStatus status;
  status.name = name;
  status.hardware_id = "none";
  status.level = DiagnosticStatus::OK;
  return status;
}

void add_value(const std::string& key, const std::string& value, DiagnosticStatus* status) {
  diagnostic_msgs::KeyValue entry;
  entry.key = key;
  entry.value = value;
  status->values.push_back(entry);
}

// The constants are of one type, the field is of another.
void worsen(std::uint8_t level, const std::string& message, DiagnosticStatus* status) {
  const auto before = static_cast<std::uint8_t>(status->level);
  if (level < before) return;
  status->message =
      level == before && !status->message.empty() ? status->message + "; " + message : message;
  status->level = static_cast<std::int8_t>(level);
}

std::string number_text(double value, int digits) {
  char text[400];
  std::snprintf(text, sizeof(text), "%.*f", digits, value);
  return text;
}

DiagnosticStatus inputs_diagnostic(const std::string& name, ros::Time stamp,
                                   const DeadReckoning& odometry, const std::string& observations,
                                   ros::Time last_used, std::size_t waiting,
                                   const RejectCounter& rejects, std::uint64_t* reported_rejects) {
  DiagnosticStatus inputs = make_diagnostic(name);
  if (odometry.empty()) {
    worsen(DiagnosticStatus::WARN, "no odometry yet", &inputs);
  } else if ((stamp - odometry.newest()).toSec() > kLongSilence) {
    worsen(DiagnosticStatus::WARN,
           "no odometry for " + number_text((stamp - odometry.newest()).toSec()) + " s", &inputs);
  }
  if (last_used.isZero()) {
    worsen(DiagnosticStatus::WARN, "no usable " + observations + " yet", &inputs);
  } else if ((stamp - last_used).toSec() > kLongSilence) {
    worsen(DiagnosticStatus::WARN,
           "no usable " + observations + " for " + number_text((stamp - last_used).toSec()) + " s",
           &inputs);
  }
  if (rejects.total() > *reported_rejects) {
    worsen(DiagnosticStatus::WARN,
           std::to_string(rejects.total() - *reported_rejects) + " messages rejected", &inputs);
  }
  *reported_rejects = rejects.total();
  if (inputs.message.empty()) inputs.message = "fine";
  add_value(observations + " waiting", std::to_string(waiting), &inputs);
  add_value("jumps back in time", std::to_string(odometry.time_jumps()), &inputs);
  add_value("jumps of the pose", std::to_string(odometry.pose_jumps()), &inputs);
  for (const RejectCounter::Count& count : rejects.counts()) {
    add_value("rejected " + count.input + " " + to_string(count.reason),
              std::to_string(count.count) + ", last: " + count.latest, &inputs);
  }
  return inputs;
}

void UpdateTiming::add(double update_time, ros::Time stamp) {
  update_time_ += kTimingRate * (update_time - update_time_);
  if (!last_.isZero() && stamp > last_) {
    const double period = (stamp - last_).toSec();
    period_ = period_ == 0.0 ? period : period_ + kTimingRate * (period - period_);
  }
  last_ = stamp;
}

DiagnosticStatus timing_diagnostic(const std::string& name, const UpdateTiming& timing,
                                   double latency, const RejectCounter& rejects,
                                   const std::string& observations, std::uint64_t* reported_drops) {
  DiagnosticStatus status = make_diagnostic(name);
  const std::uint64_t drops = rejects.count(observations, RejectReason::overload);
  if (drops > *reported_drops) {
    worsen(DiagnosticStatus::WARN,
           std::to_string(drops - *reported_drops) + " " + observations +
               " dropped: the computer is too slow",
           &status);
  }
  *reported_drops = drops;
  if (!timing.keeps_up()) {
    worsen(DiagnosticStatus::WARN, "updates take longer than the time between " + observations,
           &status);
  }
  if (status.message.empty()) status.message = "keeps up";
  add_value("update time [s]", number_text(timing.update_time()), &status);
  add_value("time between " + observations + " [s]", number_text(timing.observation_period()),
            &status);
  add_value("latency [s]", number_text(latency), &status);
  add_value("dropped", std::to_string(drops), &status);
  return status;
}

std::vector<RejectCount> to_messages(const RejectCounter& rejects) {
  std::vector<RejectCount> messages;
  for (const RejectCounter::Count& count : rejects.counts()) {
    RejectCount message;
    message.input = count.input;
    message.reason = to_string(count.reason);
    message.count = count.count;
    messages.push_back(message);
  }
  return messages;
}

FilterStatus to_message(const PopulationStatus& filter) {
  FilterStatus message;
  message.particles = static_cast<std::uint32_t>(filter.particles);
  message.effective_sample_size = filter.effective_sample_size;
  message.entropy_sample_size = filter.entropy_sample_size;
  message.distinct_ancestors_of_renewal =
      static_cast<std::uint32_t>(filter.distinct_ancestors_of_renewal);
  message.distinct_ancestors_since_start =
      static_cast<std::uint32_t>(filter.distinct_ancestors_since_start);
  message.renewed = filter.renewed;
  message.updates = static_cast<std::uint64_t>(filter.updates);
  message.renewals = static_cast<std::uint64_t>(filter.renewals);
  message.weight_resets = static_cast<std::uint64_t>(filter.weight_resets);
  message.injected = static_cast<std::uint64_t>(filter.injected);
  message.log_likelihood = filter.log_likelihood;
  return message;
}

}  // namespace pf_resampling
