#pragma once

#include <ros/datatypes.h>
#include <ros/message_traits.h>
#include <ros/serialization.h>
#include <ros/time.h>
#include <rosbag/message_instance.h>

#include <boost/shared_ptr.hpp>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "pf_resampling_core/files/new_file.hpp"

namespace pf_resampling {

/// Writes a bag (format 2.0, uncompressed; http://wiki.ros.org/Bags/Format/2.0) as a NewFile, so
/// that `path` is never half a bag. A chunk is gathered in memory and written at once: rosbag::Bag
/// moves the file's position for every message, which costs more than the message. Throws Error if
/// it cannot be written.
class BagWriter {
 public:
  explicit BagWriter(const std::string& path);

  template <typename Message>
  void write(const std::string& topic, const ros::Time& time, const Message& message) {
    write(topic, time, message, {}, &plain_);
  }

  /// Writes a message whose connection header says that it is latched, so that rosbag play latches
  /// it.
  template <typename Message>
  void write_latched(const std::string& topic, const ros::Time& time, const Message& message) {
    write(topic, time, message, {{"callerid", "/pf_resampling"}, {"latching", "1"}}, &latched_);
  }

  /// Copies a message of another bag, with its connection header (type, latching).
  void copy(const rosbag::MessageInstance& message);

  /// Throws the Error once more that a write threw before.
  void check() const;

  /// Writes what is left, and the index, and gives the bag its name.
  void finish();

 private:
  struct Connection {
    std::string record;
    bool written = false;  // in any chunk
  };
  struct IndexEntry {
    ros::Time time;
    std::uint32_t offset = 0;
  };
  struct Chunk {
    std::uint64_t position = 0;
    ros::Time begin, end;
    std::map<std::uint32_t, std::uint32_t> counts;  // messages by connection
  };

  /// `more`: what its connection header says beside the type.
  template <typename Message>
  void write(const std::string& topic, const ros::Time& time, const Message& message,
             const ros::M_string& more, std::map<std::string, std::uint32_t>* connections) {
    auto connection = connections->find(topic);
    if (connection == connections->end()) {
      ros::M_string header = more;
      header["type"] = ros::message_traits::datatype(message);
      header["md5sum"] = ros::message_traits::md5sum(message);
      header["message_definition"] = ros::message_traits::definition(message);
      connection = connections->emplace(topic, add_connection(topic, header)).first;
    }
    const std::uint32_t size = ros::serialization::serializationLength(message);
    ros::serialization::OStream stream(room_for(connection->second, time, size), size);
    ros::serialization::serialize(stream, message);
  }

  std::uint32_t add_connection(const std::string& topic, const ros::M_string& header);
  /// For a message of `size` bytes, to be filled in before the next call.
  std::uint8_t* room_for(std::uint32_t connection, const ros::Time& time, std::uint32_t size);
  void close_chunk();
  void put(const std::string& bytes);
  std::string file_header(std::uint64_t index_position) const;

  NewFile file_;
  std::string fault_;  // why it could not be written; empty: it could
  std::uint64_t position_ = 0;
  std::vector<Connection> connections_;
  std::map<std::string, std::uint32_t> plain_, latched_;  // by topic
  // Those copied, by the address of their header, which is kept.
  std::map<boost::shared_ptr<ros::M_string>, std::uint32_t> copied_;
  std::vector<Chunk> chunks_;
  std::string chunk_;                                       // data of the open chunk
  std::map<std::uint32_t, std::vector<IndexEntry>> index_;  // of the open chunk, by connection
  ros::Time chunk_begin_, chunk_end_;
};

}  // namespace pf_resampling
