#pragma once

#include <rosbag/bag.h>

#include <string>
#include <vector>

namespace pf_resampling {

/// Where a bag has what the filters need.
struct CheckedTopics {
  std::string odom = "/odom";
  std::string ranges = "/ranges";
  std::string sensor_ranges = "/sensor_ranges";  ///< looked at where there are no `ranges`
  std::string beacons = "/beacons";
  std::string landmarks = "/landmarks";
  std::string ground_truth = "/ground_truth";
};

/// Whether a filter can run on a bag.
struct FilterVerdict {
  std::string filter;                 ///< "beacon_mcl" or "fastslam"
  std::vector<std::string> problems;  ///< why it cannot, a line each
  std::string command;                ///< what runs it, with the options that this bag needs

  bool is_ready() const { return problems.empty(); }
  /// "ready for fastslam: yes" or "ready for fastslam: no: ...".
  std::string text() const;
};

/// What a look at a bag has found.
struct BagFindings {
  std::string text;                  ///< tables for people, several lines
  std::vector<std::string> remarks;  ///< what is odd but does not hinder, a line each
  FilterVerdict beacon_mcl{"beacon_mcl", {}, {}};
  FilterVerdict fastslam{"fastslam", {}, {}};

  bool is_ready_for_any() const { return beacon_mcl.is_ready() || fastslam.is_ready(); }
};

/// Looks at topics, rates, gaps, stamps, frames, numbers and ids. Throws Error if the bag is
/// damaged.
BagFindings findings_of(const rosbag::Bag& bag, const CheckedTopics& topics);

}  // namespace pf_resampling
