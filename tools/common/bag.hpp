#pragma once

#include <ros/message_traits.h>
#include <rosbag/bag.h>
#include <rosbag/exceptions.h>
#include <rosbag/message_instance.h>

#include <boost/shared_ptr.hpp>
#include <cstdint>
#include <exception>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "pf_resampling_core/files/new_file.hpp"
#include "tools/common/bag_file_writer.hpp"

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

/// Writes a bag as a NewFile, so that `path` is never half a bag. Messages are to be written in
/// order of time.
class BagWriter {
 public:
  /// Throws Error if the file cannot be written.
  explicit BagWriter(const std::string& path);

  template <typename Message>
  void write(const std::string& topic, const ros::Time& time, const Message& message) {
    auto connection = plain_.find(topic);
    if (connection == plain_.end()) {
      connection = plain_.emplace(topic, file_.add_connection(topic, header_of(message))).first;
    }
    write_message(connection->second, time, message);
  }

  /// Writes a message whose connection header says that it is latched, so that rosbag play latches
  /// it.
  template <typename Message>
  void write_latched(const std::string& topic, const ros::Time& time, const Message& message) {
    auto connection = latched_.find(topic);
    if (connection == latched_.end()) {
      ros::M_string header = header_of(message);
      header["callerid"] = "/pf_resampling";
      header["latching"] = "1";
      connection = latched_.emplace(topic, file_.add_connection(topic, header)).first;
    }
    write_message(connection->second, time, message);
  }

  /// Copies a message of another bag, with its connection header (type, latching).
  void copy(const rosbag::MessageInstance& message);

  /// Throws Error if something before could not be written.
  void check() const { file_.check(); }

  /// Closes the bag and gives it its name. Throws Error.
  void finish();

 private:
  template <typename Message>
  static ros::M_string header_of(const Message& message) {
    return {{"type", ros::message_traits::datatype(message)},
            {"md5sum", ros::message_traits::md5sum(message)},
            {"message_definition", ros::message_traits::definition(message)}};
  }

  template <typename Message>
  void write_message(std::uint32_t connection, const ros::Time& time, const Message& message) {
    const std::uint32_t size = ros::serialization::serializationLength(message);
    ros::serialization::OStream stream(file_.write(connection, time, size), size);
    ros::serialization::serialize(stream, message);
  }

  NewFile new_file_;
  BagFileWriter file_;
  std::map<std::string, std::uint32_t> plain_, latched_;  // connections by topic
  // Those copied, by the address of their header, which is kept.
  std::map<boost::shared_ptr<ros::M_string>, std::uint32_t> copied_;
};

}  // namespace pf_resampling
