#include "tools/common/bag_writer.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstring>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

const std::string kVersion = "#ROSBAG V2.0\n";
constexpr std::size_t kChunkSize = 768 * 1024;  // as rosbag record has it
constexpr std::size_t kFileHeaderSize = 4096;

// Kinds of records.
constexpr char kMessageData = 0x02;
constexpr char kFileHeader = 0x03;
constexpr char kIndexData = 0x04;
constexpr char kChunk = 0x05;
constexpr char kChunkInfo = 0x06;
constexpr char kConnection = 0x07;

/// Numbers are little-endian, as on every machine that ROS 1 runs on.
template <typename Number>
std::string bytes_of(Number number) {
  std::string bytes(sizeof(number), '\0');
  std::memcpy(&bytes[0], &number, sizeof(number));
  return bytes;
}

std::string bytes_of(const ros::Time& time) {
  return bytes_of(time.sec) + bytes_of(time.nsec);
}

std::string field(const std::string& name, const std::string& value) {
  return bytes_of(static_cast<std::uint32_t>(name.size() + 1 + value.size())) + name + "=" + value;
}

std::string kind(char op) {
  return field("op", std::string(1, op));
}

std::string with_size(const std::string& text) {
  return bytes_of(static_cast<std::uint32_t>(text.size())) + text;
}

}  // namespace

BagWriter::BagWriter(const std::string& path) : file_(path, path + ":") {
  chunk_.reserve(2 * kChunkSize);
  put(kVersion + file_header(0));
}

std::string BagWriter::file_header(std::uint64_t index_position) const {
  const std::string header =
      field("chunk_count", bytes_of(static_cast<std::uint32_t>(chunks_.size()))) +
      field("conn_count", bytes_of(static_cast<std::uint32_t>(connections_.size()))) +
      field("index_pos", bytes_of(index_position)) + kind(kFileHeader);
  return with_size(header) + with_size(std::string(kFileHeaderSize - header.size(), ' '));
}

std::uint32_t BagWriter::add_connection(const std::string& topic, const ros::M_string& header) {
  const auto id = static_cast<std::uint32_t>(connections_.size());
  std::string data = field("topic", topic);
  for (const auto& [name, value] : header) {
    if (name != "topic") data += field(name, value);
  }
  Connection connection;
  connection.record =
      with_size(field("conn", bytes_of(id)) + kind(kConnection) + field("topic", topic)) +
      with_size(data);
  connections_.push_back(connection);
  return id;
}

void BagWriter::copy(const rosbag::MessageInstance& message) {
  const boost::shared_ptr<ros::M_string> header = message.getConnectionHeader();
  auto connection = copied_.find(header);
  if (connection == copied_.end()) {
    connection = copied_.emplace(header, add_connection(message.getTopic(), *header)).first;
  }
  const std::uint32_t size = message.size();
  ros::serialization::OStream stream(room_for(connection->second, message.getTime(), size), size);
  message.write(stream);
}

std::uint8_t* BagWriter::room_for(std::uint32_t connection, const ros::Time& time,
                                  std::uint32_t size) {
  if (chunk_.size() > kChunkSize) close_chunk();
  if (chunk_.empty()) chunk_begin_ = chunk_end_ = time;
  chunk_begin_ = std::min(chunk_begin_, time);
  chunk_end_ = std::max(chunk_end_, time);
  if (!connections_[connection].written) {
    chunk_ += connections_[connection].record;
    connections_[connection].written = true;
  }
  index_[connection].push_back({time, static_cast<std::uint32_t>(chunk_.size())});

  // Header of a message: conn, op, time; the same length for each, so filled into a template.
  static const std::string kTemplate =
      with_size(field("conn", bytes_of(std::uint32_t{0})) + kind(kMessageData) +
                field("time", bytes_of(ros::Time()))) +
      bytes_of(std::uint32_t{0});
  constexpr std::size_t kConnectionAt = 4 + 4 + 5;
  constexpr std::size_t kTimeAt = kConnectionAt + 4 + 4 + 4 + 4 + 5;
  const std::size_t begin = chunk_.size();
  chunk_ += kTemplate;
  chunk_.resize(begin + kTemplate.size() + size);
  char* const record = &chunk_[begin];
  std::memcpy(record + kConnectionAt, &connection, 4);
  std::memcpy(record + kTimeAt, &time.sec, 4);
  std::memcpy(record + kTimeAt + 4, &time.nsec, 4);
  std::memcpy(record + kTemplate.size() - 4, &size, 4);
  return reinterpret_cast<std::uint8_t*>(record) + kTemplate.size();
}

void BagWriter::close_chunk() {
  if (chunk_.empty()) return;
  Chunk chunk;
  chunk.position = position_;
  chunk.begin = chunk_begin_;
  chunk.end = chunk_end_;
  const auto size = static_cast<std::uint32_t>(chunk_.size());
  put(with_size(field("compression", "none") + kind(kChunk) + field("size", bytes_of(size))) +
      bytes_of(size));
  put(chunk_);
  std::string index;
  for (auto& [connection, entries] : index_) {
    if (entries.empty()) continue;
    std::string data;
    for (const IndexEntry& entry : entries) data += bytes_of(entry.time) + bytes_of(entry.offset);
    const auto count = static_cast<std::uint32_t>(entries.size());
    index += with_size(field("conn", bytes_of(connection)) + field("count", bytes_of(count)) +
                       kind(kIndexData) + field("ver", bytes_of(std::uint32_t{1}))) +
             with_size(data);
    chunk.counts[connection] = count;
    entries.clear();
  }
  put(index);
  chunks_.push_back(chunk);
  chunk_.clear();
}

void BagWriter::finish() {
  close_chunk();
  const std::uint64_t index_position = position_;
  std::string index;
  for (const Connection& connection : connections_) index += connection.record;
  for (const Chunk& chunk : chunks_) {
    std::string data;
    for (const auto& [connection, count] : chunk.counts) {
      data += bytes_of(connection) + bytes_of(count);
    }
    index += with_size(field("chunk_pos", bytes_of(chunk.position)) +
                       field("count", bytes_of(static_cast<std::uint32_t>(chunk.counts.size()))) +
                       field("end_time", bytes_of(chunk.end)) + kind(kChunkInfo) +
                       field("start_time", bytes_of(chunk.begin)) +
                       field("ver", bytes_of(std::uint32_t{1}))) +
             with_size(data);
  }
  put(index);
  lseek(file_.descriptor(), 0, SEEK_SET);
  put(kVersion + file_header(index_position));
  file_.finish();
}

void BagWriter::check() const {
  if (!fault_.empty()) throw Error(fault_);
}

void BagWriter::put(const std::string& bytes) {
  check();
  try {
    file_.write(bytes);
  } catch (const Error& error) {
    fault_ = error.what();
    throw;
  }
  position_ += bytes.size();
}

}  // namespace pf_resampling
