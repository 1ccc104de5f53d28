#pragma once

#include <diagnostic_msgs/DiagnosticStatus.h>

#include <cstdint>
#include <string>
#include <vector>

#include <pf_resampling/FilterStatus.h>
#include <pf_resampling/RejectCount.h>

#include "pf_resampling_core/strategy/strategy.hpp"
#include "src/messages/rejects.hpp"
#include "src/odometry/dead_reckoning.hpp"

namespace pf_resampling {

/// An entry of /diagnostics that is fine so far.
diagnostic_msgs::DiagnosticStatus make_diagnostic(const std::string& name);

void add_value(const std::string& key, const std::string& value,
               diagnostic_msgs::DiagnosticStatus* status);

/// Raises the level, with its reason; reasons of the same level are joined, lower ones dropped.
/// `level`: one of DiagnosticStatus' constants.
void worsen(std::uint8_t level, const std::string& message,
            diagnostic_msgs::DiagnosticStatus* status);

/// With so many digits behind the point.
std::string number_text(double value, int digits = 3);

/// The entry on what comes in: odometry, observations (called `observations`: "ranges"; the stamp
/// of the last that was used, zero if none was, and how many wait), and what was rejected.
/// `reported_rejects`: how many of them earlier entries have told of.
diagnostic_msgs::DiagnosticStatus inputs_diagnostic(const std::string& name, ros::Time stamp,
                                                    const DeadReckoning& odometry,
                                                    const std::string& observations,
                                                    ros::Time last_used, std::size_t waiting,
                                                    const RejectCounter& rejects,
                                                    std::uint64_t* reported_rejects);

/// How long updates take, beside how often there is something to update with: running means.
class UpdateTiming {
 public:
  /// An update of `update_time` (s) with what was observed at `stamp`.
  void add(double update_time, ros::Time stamp);

  double update_time() const { return update_time_; }    ///< s
  double observation_period() const { return period_; }  ///< s; 0 until there were two
  bool keeps_up() const { return period_ == 0.0 || update_time_ < period_; }

 private:
  double update_time_ = 0.0;
  double period_ = 0.0;
  ros::Time last_;
};

/// The entry on time: updates, latency (s, of what was used last), and what was dropped for it
/// (rejections for overload of the input `observations`). `reported_drops`: how many of them
/// earlier entries have told of.
diagnostic_msgs::DiagnosticStatus timing_diagnostic(const std::string& name,
                                                    const UpdateTiming& timing, double latency,
                                                    const RejectCounter& rejects,
                                                    const std::string& observations,
                                                    std::uint64_t* reported_drops);

/// As in FilterStatus.
std::vector<RejectCount> to_messages(const RejectCounter& rejects);

/// What the status of both filters says of the population.
FilterStatus to_message(const PopulationStatus& filter);

}  // namespace pf_resampling
