#pragma once

#include <rosbag/view.h>

#include <cstdint>
#include <map>
#include <set>
#include <string>

#include "tools/common/bag.hpp"

namespace pf_resampling {

/// How many messages a bag has on each topic.
inline std::map<std::string, std::uint64_t> counts_of(const std::string& path) {
  const rosbag::Bag bag = open_bag(path);
  std::map<std::string, std::uint64_t> counts;
  for (const rosbag::MessageInstance& message : rosbag::View(bag)) ++counts[message.getTopic()];
  return counts;
}

/// The topics of a bag with a message that rosbag play latches.
inline std::set<std::string> latched_in(const std::string& path) {
  const rosbag::Bag bag = open_bag(path);
  std::set<std::string> latched;
  for (const rosbag::MessageInstance& message : rosbag::View(bag)) {
    if (message.isLatching()) latched.insert(message.getTopic());
  }
  return latched;
}

}  // namespace pf_resampling
