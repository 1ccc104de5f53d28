#pragma once

#include <rosbag/bag.h>
#include <rosbag/exceptions.h>
#include <rosbag/message_instance.h>

#include <boost/shared_ptr.hpp>
#include <exception>
#include <functional>
#include <string>
#include <vector>

namespace pf_resampling {

/// Opens a bag for reading. Throws Error with one line that names the file and what to do: missing,
/// a directory, not a bag, truncated or not indexed (`rosbag reindex`).
rosbag::Bag open_bag(const std::string& path);

/// What a record of a bag holds; null if that is of another type. Throws rosbag::BagException,
/// which those who go through a bag turn into an Error with the file's name, if it is damaged.
template <typename Message>
boost::shared_ptr<Message> message_in(const rosbag::MessageInstance& record) {
  try {
    return record.instantiate<Message>();
  } catch (const rosbag::BagException&) {
    throw;
  } catch (const std::exception& error) {  // what is read beyond its end, memory for what has none
    throw rosbag::BagFormatException("a message on " + record.getTopic() +
                                     " is damaged: " + error.what());
  }
}

/// The topics of a bag and their types, in one line: "/odom (nav_msgs/Odometry), ..."; "nothing".
std::string topics_in_words(const rosbag::Bag& bag);

/// Hands out every message of some bags in order of time. Of those with the same time, the topics
/// in `order` come first, in that order (transforms, what is observed, odometry: what others need),
/// whatever the order in the file, which rosbag does not tell: so a copy of a bag gives the same
/// result. Throws Error that names the file if it cannot be read to its end.
void for_each_in_order(const std::vector<const rosbag::Bag*>& bags, const std::string& path,
                       const std::vector<std::string>& order,
                       const std::function<void(const rosbag::MessageInstance&)>& take);

}  // namespace pf_resampling
