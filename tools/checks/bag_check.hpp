#pragma once

#include <rosbag/bag.h>

#include <string>
#include <vector>

namespace pf_resampling {

/// Where a bag has what beacon_mcl needs.
struct BagCheckTopics {
  std::string odom = "/odom";
  std::string ranges = "/ranges";
  std::string beacons = "/beacons";
  std::string landmarks = "/landmarks";
  std::string ground_truth = "/ground_truth";
};

/// What a look at a bag has found.
struct BagCheck {
  std::string text;                   ///< tables for people, several lines
  std::vector<std::string> remarks;   ///< what is odd but does not hinder, a line each
  std::vector<std::string> problems;  ///< why beacon_mcl cannot run on it, a line each

  /// "ready for beacon_mcl: yes" or "ready for beacon_mcl: no: ...".
  std::string verdict() const;
};

/// Looks at topics, rates, gaps, stamps, frames, numbers and ids. Throws Error if the bag is
/// damaged.
BagCheck check_bag(const rosbag::Bag& bag, const BagCheckTopics& topics);

}  // namespace pf_resampling
