#pragma once

#include <rosbag/bag.h>

#include <string>

#include "tools/checks/bag_findings.hpp"
#include "tools/checks/bag_survey.hpp"
#include "tools/checks/dry_run.hpp"

namespace pf_resampling {

/// What is in a bag, as tables: topics, stamps, frames, ranges per beacon, and what landmarks
/// FastSLAM has seen.
std::string tables_of(const rosbag::Bag& bag, const CheckedTopics& names, const BagSurvey& survey,
                      const LandmarkSurvey& seen);

}  // namespace pf_resampling
