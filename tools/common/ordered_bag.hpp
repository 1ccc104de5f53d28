#pragma once

#include <rosbag/bag.h>
#include <rosbag/message_instance.h>

#include <functional>
#include <string>
#include <vector>

namespace pf_resampling {

/// Hands out every message of a bag in order of time. Of those with the same time, the topics in
/// `order` come first, in that order (transforms, what is observed, odometry: what others need),
/// whatever the order in the file, which rosbag does not tell: so a copy of a bag gives the same
/// result. Throws Error that names the file if it cannot be read to its end.
void for_each_in_order(const rosbag::Bag& bag, const std::string& path,
                       const std::vector<std::string>& order,
                       const std::function<void(const rosbag::MessageInstance&)>& take);

}  // namespace pf_resampling
