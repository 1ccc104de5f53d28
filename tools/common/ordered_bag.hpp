#pragma once

#include <rosbag/bag.h>
#include <rosbag/message_instance.h>
#include <rosbag/view.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace pf_resampling {

/// Hands out every message in order of time. Of those with the same time, the topics in `order`
/// come first, in that order (transforms, what is observed, odometry: what others need), whatever
/// the order in the file, which rosbag does not tell: so a copy of a bag gives the same result.
void for_each_in_order(rosbag::View* view, const std::vector<std::string>& order,
                       const std::function<void(const rosbag::MessageInstance&)>& take);

/// The same for all of a bag; its Error names the file when that cannot be read to its end.
void for_each_in_order(const rosbag::Bag& bag, const std::string& path,
                       const std::vector<std::string>& order,
                       const std::function<void(const rosbag::MessageInstance&)>& take);

/// The message as a variant of pointers to messages; nothing if it is of another type.
template <typename Message, typename Variant>
std::optional<Variant> instantiate_as(const rosbag::MessageInstance& message) {
  const auto pointer = message.instantiate<Message>();
  if (!pointer) return std::nullopt;
  return Variant(typename Message::ConstPtr(pointer));
}

}  // namespace pf_resampling
