#pragma once

#include <ros/datatypes.h>
#include <ros/serialization.h>
#include <ros/time.h>

#include <cstdint>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

namespace pf_resampling {

/// Writes a bag file (format 2.0, uncompressed; http://wiki.ros.org/Bags/Format/2.0). A chunk is
/// gathered in memory and written at once: rosbag::Bag moves the file's position for every message,
/// which costs more than the message.
class BagFileWriter {
 public:
  /// Of an open file, which stays open. Throws Error, here and below, if it cannot be written;
  /// `name` is what the error calls it.
  BagFileWriter(int descriptor, const std::string& name);
  ~BagFileWriter();
  BagFileWriter(const BagFileWriter&) = delete;
  BagFileWriter& operator=(const BagFileWriter&) = delete;

  /// Adds a connection; `header` holds at least type, md5sum and message_definition. The number
  /// returned is for write().
  std::uint32_t add_connection(const std::string& topic, const ros::M_string& header);

  /// Room for a message of `size` bytes, to be filled before the next call.
  std::uint8_t* write(std::uint32_t connection, const ros::Time& time, std::uint32_t size);

  /// Throws the Error once more that a write threw before.
  void check() const;

  /// Writes what is left, and the index.
  void close();

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

  void close_chunk();
  void put(const void* data, std::size_t size);
  void put_record(const std::string& header, const std::string& data);
  std::string file_header(std::uint64_t index_position) const;

  std::string name_;
  std::FILE* file_ = nullptr;
  bool failed_ = false;
  std::uint64_t position_ = 0;
  std::vector<Connection> connections_;
  std::vector<Chunk> chunks_;
  std::vector<std::uint8_t> chunk_;                         // data of the open chunk
  std::map<std::uint32_t, std::vector<IndexEntry>> index_;  // of the open chunk, by connection
  ros::Time chunk_begin_, chunk_end_;
};

}  // namespace pf_resampling
