#pragma once

#include <rosbag/bag.h>

#include <string>
#include <vector>

#include "tools/common/command_line.hpp"
#include "tools/common/filter_topics.hpp"

namespace pf_resampling {

/// Where a bag has what the filters need.
struct CheckedTopics : BeaconMclTopics {
  std::string landmarks = FastSlamTopics().landmarks;
  std::string ground_truth = "/ground_truth";

  FastSlamTopics of_fastslam() const;
};

/// How the filters are to be configured.
struct CheckedConfiguration {
  BeaconMclPipelineOptions beacon_mcl;
  FastSlamPipelineOptions fastslam;
  std::string beacon_mcl_fault, fastslam_fault;  ///< why it does not take it; empty: it does
  std::vector<std::string> words;                ///< as on the command line

  const FrameNames& frames() const {
    return beacon_mcl_fault.empty() ? beacon_mcl.frames : fastslam.frames;
  }
  OdometrySource odometry_source() const { return odometry_input().source; }
  bool uses_imu() const { return odometry_input().imu_heading != ImuUse::none; }
  const OdometryBufferOptions& odometry_input() const {
    return beacon_mcl_fault.empty() ? beacon_mcl.odometry_input : fastslam.odometry_input;
  }
};
/// What --config and --set say. Throws Error if neither filter takes it.
CheckedConfiguration configuration_of(const CommandLine& line);

/// Whether a filter can run on a bag.
struct FilterVerdict {
  std::string filter;                 ///< "beacon_mcl" or "fastslam"
  std::vector<std::string> problems;  ///< why it cannot, a line each
  std::string command;                ///< what runs it, with the options that this bag needs
  std::vector<std::string> advice;    ///< options of check_bag and run_bag that could mend it
  std::size_t advised = 0;            ///< how many of the problems

  bool is_ready() const { return problems.empty(); }
  /// Whether what is advised could mend all that is wrong.
  bool is_worth_a_try() const { return !is_ready() && advised == problems.size(); }
  /// "ready for fastslam: yes" or "ready for fastslam: no: ...".
  std::string text() const;
};

/// What a look at a bag has found.
struct BagFindings {
  std::vector<std::string> remarks;  ///< what is odd but does not hinder, a line each
  FilterVerdict beacon_mcl{"beacon_mcl", {}, {}, {}, 0};
  FilterVerdict fastslam{"fastslam", {}, {}, {}, 0};

  bool is_ready_for_any() const { return beacon_mcl.is_ready() || fastslam.is_ready(); }
};

/// Looks at topics, rates, gaps, stamps, frames, numbers and ids. Throws Error if the bag is
/// damaged.
BagFindings findings_of(const rosbag::Bag& bag, const CheckedTopics& topics,
                        const CheckedConfiguration& configuration = {});

/// As a word of a shell command.
std::string shell_word(const std::string& text);

}  // namespace pf_resampling
