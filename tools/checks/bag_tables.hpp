#pragma once

#include <rosbag/bag.h>

#include <string>

#include "tools/checks/bag_findings.hpp"
#include "tools/checks/bag_survey.hpp"

namespace pf_resampling {

/// What is in a bag, as tables: topics, stamps, frames, ranges per beacon, landmark observations.
std::string tables_of(const rosbag::Bag& bag, const CheckedTopics& names, const BagSurvey& survey);

}  // namespace pf_resampling
