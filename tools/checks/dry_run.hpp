#pragma once

#include <rosbag/bag.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tools/common/filter_topics.hpp"

namespace pf_resampling {

/// The landmark observations that FastSLAM used.
struct LandmarkSurvey {
  std::size_t observations = 0;
  std::map<std::int64_t, std::size_t> by_id;  ///< how often each id was seen
};

/// What a filter says of the messages of a bag.
struct DryRun {
  std::uint64_t used = 0;            ///< of its observations
  std::string why_none;              ///< if that is none
  std::vector<std::string> remarks;  ///< its warnings; what it did not use, and why
  LandmarkSurvey seen;               ///< of FastSLAM
};

/// Runs a filter over a bag, with few particles: what it takes does not depend on them. Throws
/// Error if the bag is damaged.
DryRun dry_run(const rosbag::Bag& bag, const BeaconMclTopics& topics,
               const BeaconMclPipelineOptions& options);
DryRun dry_run(const rosbag::Bag& bag, const FastSlamTopics& topics,
               const FastSlamPipelineOptions& options);

}  // namespace pf_resampling
