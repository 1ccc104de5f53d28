#include "tools/common/bag_structure.hpp"

#include <rosbag/chunked_file.h>
#include <rosbag/stream.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <vector>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

const std::string kMagic = "#ROSBAG V2.0\n";
constexpr std::uint64_t kLargestHeader = std::uint64_t{1} << 24;
constexpr std::uint64_t kLargestChunk = std::uint64_t{1} << 30;
// Of what chunks are unpacked to, in all: so much, and so many times the file's size. Recordings
// are far below; a few bytes can claim to be hours of unpacking.
constexpr std::uint64_t kUnpacked = std::uint64_t{1} << 30;
constexpr std::uint64_t kUnpackedPerByte = 1000;
// A byte of LZ4 stands for no more than 255.
constexpr std::uint64_t kLz4PerByte = 255;
constexpr std::uint64_t kLz4More = 64;
// rosbag takes a time that grows with the square of the connections, and more per message.
constexpr std::uint32_t kMostConnections = 5000;
// Of a connection: rosbag prints lines of its own about longer fields.
constexpr std::size_t kLongestField = 1000000;

// What is wrong, without the file's name.
struct Damage : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// More than is taken of something, without the file's name. No damage that could be mended.
struct Excess : std::runtime_error {
  using std::runtime_error::runtime_error;
};

void require(bool holds, const std::string& what) {
  if (!holds) throw Damage(what);
}

// Bytes of known length, read from the front.
class Span {
 public:
  Span(const char* bytes, std::uint64_t size) : bytes_(bytes), left_(size) {}

  bool empty() const { return left_ == 0; }
  Span take(std::uint64_t size, const std::string& what) {
    require(size <= left_, what + " goes beyond its end");
    const Span taken(bytes_, size);
    bytes_ += size;
    left_ -= size;
    return taken;
  }
  template <typename Number>
  Number number(const std::string& what) {
    const Span taken = take(sizeof(Number), what);
    Number value;
    std::memcpy(&value, taken.bytes_, sizeof value);
    return value;
  }
  std::string text() const { return {bytes_, static_cast<std::size_t>(left_)}; }
  std::uint64_t size() const { return left_; }

 private:
  const char* bytes_;
  std::uint64_t left_;
};

enum class Kind : std::uint8_t {
  message = 2,
  bag = 3,
  index = 4,
  chunk = 5,
  chunk_info = 6,
  connection = 7,
};

std::string name_of(Kind kind) {
  switch (kind) {
    case Kind::message:
      return "a message";
    case Kind::bag:
      return "its first record";
    case Kind::index:
      return "the index of a chunk";
    case Kind::chunk:
      return "a chunk";
    case Kind::chunk_info:
      return "what it says of a chunk";
    case Kind::connection:
      return "a connection";
  }
  return "a record";
}

// Fields of a header: "name=value" with a length before each.
class Fields {
 public:
  explicit Fields(Span bytes) {
    while (!bytes.empty()) {
      const auto size = bytes.number<std::uint32_t>("a header");
      const std::string field = bytes.take(size, "a header").text();
      const std::size_t equals = field.find('=');
      require(equals != std::string::npos && equals > 0, "a header is damaged");
      fields_[field.substr(0, equals)] = field.substr(equals + 1);
    }
  }

  bool has(const std::string& name) const { return fields_.count(name) > 0; }
  const std::string& text(const std::string& name) const {
    const auto found = fields_.find(name);
    require(found != fields_.end(), "a header has no " + name);
    return found->second;
  }
  template <typename Number>
  Number number(const std::string& name) const {
    const std::string& value = text(name);
    require(value.size() == sizeof(Number), "the field " + name + " of a header is damaged");
    Number result;
    std::memcpy(&result, value.data(), sizeof result);
    return result;
  }
  std::size_t longest() const {
    std::size_t longest = 0;
    for (const auto& [name, value] : fields_) {
      longest = std::max({longest, name.size(), value.size()});
    }
    return longest;
  }
  bool is(Kind kind) const { return number<std::uint8_t>("op") == static_cast<std::uint8_t>(kind); }
  void require_kind(Kind kind) const {
    require(is(kind), name_of(kind) + " is not where it should be");
  }

 private:
  std::map<std::string, std::string> fields_;
};

// A record of the file: its header, and where its data are.
struct Record {
  Fields fields;
  std::uint64_t data;
  std::uint32_t size;
  std::uint64_t end() const { return data + size; }
};

class File {
 public:
  explicit File(const std::string& path)
      : stream_(path, std::ios::binary), size_(std::filesystem::file_size(path)) {
    require(stream_.is_open(), "cannot be read");
  }

  std::uint64_t size() const { return size_; }

  std::vector<char> bytes(std::uint64_t place, std::uint64_t size) {
    require(place <= size_ && size <= size_ - place, "is truncated");
    std::vector<char> bytes(static_cast<std::size_t>(size));
    stream_.seekg(static_cast<std::streamoff>(place));
    stream_.read(bytes.data(), static_cast<std::streamsize>(size));
    require(stream_.good(), "cannot be read");
    return bytes;
  }

  Record record(std::uint64_t place, Kind kind) {
    const std::uint32_t header_size = number(place);
    require(header_size <= kLargestHeader, name_of(kind) + " has a header without end");
    const std::vector<char> header = bytes(place + 4, header_size);
    Record record{Fields(Span(header.data(), header.size())), place + 8 + header_size,
                  number(place + 4 + header_size)};
    record.fields.require_kind(kind);
    require(record.end() <= size_, "is truncated");
    return record;
  }

 private:
  std::uint32_t number(std::uint64_t place) {
    const std::vector<char> four = bytes(place, 4);
    return Span(four.data(), 4).number<std::uint32_t>("a length");
  }

  std::ifstream stream_;
  std::uint64_t size_;
};

using Connections = std::set<std::uint32_t>;

// Where something begins and ends.
struct Extent {
  std::uint64_t begin;
  std::uint64_t end;
};

// What is said of one thing again and again would be read again and again, and so would what lies
// in many others.
void require_apart(std::vector<Extent> messages) {
  std::sort(messages.begin(), messages.end(),
            [](const Extent& a, const Extent& b) { return a.begin < b.begin; });
  for (std::size_t i = 1; i < messages.size(); ++i) {
    require(messages[i].begin != messages[i - 1].begin, "it says the same message twice");
    require(messages[i].begin >= messages[i - 1].end, "messages overlap");
  }
}

// What a chunk says that it is unpacked to; 0 if it is not packed.
std::uint64_t unpacked_size(const Record& chunk) {
  const std::string& compression = chunk.fields.text("compression");
  const auto size = chunk.fields.number<std::uint32_t>("size");
  require(size <= kLargestChunk, "a chunk claims to hold more than a GiB");
  if (compression == "none") return 0;
  require(compression != "lz4" || size <= kLz4PerByte * chunk.size + kLz4More,
          "a chunk claims to hold more than LZ4 can pack into it");
  return size;
}

// The contents of a chunk, as long as its header says.
std::vector<char> contents_of(File* file, const Record& chunk) {
  const auto size = chunk.fields.number<std::uint32_t>("size");
  std::vector<char> packed = file->bytes(chunk.data, chunk.size);
  const std::string& compression = chunk.fields.text("compression");
  if (compression == "none") {
    require(chunk.size == size, "a chunk has another length than it says");
    return packed;
  }
  require(compression == "bz2" || compression == "lz4",
          "a chunk is compressed in a way that is not known");
  rosbag::ChunkedFile nowhere;
  rosbag::StreamFactory streams(&nowhere);
  const auto stream =
      streams.getStream(compression == "bz2" ? rosbag::compression::BZ2 : rosbag::compression::LZ4);
  std::vector<char> contents;
  const auto unpack = [&](char fill) {
    contents.assign(size, fill);
    stream->decompress(reinterpret_cast<std::uint8_t*>(contents.data()), size,
                       reinterpret_cast<std::uint8_t*>(packed.data()), chunk.size);
  };
  unpack('\x55');
  // Unpacked to less than that, the end is as it was before.
  const bool may_be_short = size > 0 && contents.back() == '\x55';
  if (may_be_short) unpack('\x2a');
  require(!may_be_short || contents.back() == '\x55', "a chunk is shorter than it says");
  return contents;
}

// Time zero is none to ROS, and it cannot reckon with those of 2038 and later.
bool is_time(std::uint32_t seconds, std::uint32_t nanoseconds) {
  return seconds <= std::numeric_limits<std::int32_t>::max() && nanoseconds < 1000000000 &&
         (seconds > 0 || nanoseconds > 0);
}

Span from(const std::vector<char>& contents, std::uint64_t place) {
  require(place < contents.size(), "an index points beyond its chunk");
  return {contents.data() + place, contents.size() - place};
}

// Where the message at a place of a chunk begins and ends.
Extent message_at(const std::vector<char>& contents, std::uint32_t place) {
  Span bytes = from(contents, place);
  for (int part = 0; part < 2; ++part) {  // the header and the data
    bytes.take(bytes.number<std::uint32_t>(name_of(Kind::message)), name_of(Kind::message));
  }
  return {place, contents.size() - bytes.size()};
}

// The header of a message. (rosbag would pass over the header of a connection there, but take its
// data for the next header.)
void check_message(const std::vector<char>& contents, const Extent& message,
                   const Connections& connections) {
  Span bytes = from(contents, message.begin);
  const auto header_size = bytes.number<std::uint32_t>(name_of(Kind::message));
  const Fields fields(bytes.take(header_size, name_of(Kind::message)));
  fields.require_kind(Kind::message);
  require(connections.count(fields.number<std::uint32_t>("conn")) > 0,
          "a message is of no connection");
  fields.number<std::uint64_t>("time");
}

Record chunk_of(File* file, const Record& info) {
  return file->record(info.fields.number<std::uint64_t>("chunk_pos"), Kind::chunk);
}

void check_chunk(File* file, const Record& info, const Connections& connections) {
  require(info.fields.number<std::uint32_t>("ver") == 1, "is of a version that is not known");
  const Record chunk = chunk_of(file, info);
  const std::vector<char> contents = contents_of(file, chunk);
  const auto indices = info.fields.number<std::uint32_t>("count");
  require(info.size == 8 * std::uint64_t{indices}, name_of(Kind::chunk_info) + " is damaged");
  std::uint64_t place = chunk.end();
  std::vector<Extent> found;  // the messages in the chunk
  for (std::uint32_t i = 0; i < indices; ++i) {
    const Record index = file->record(place, Kind::index);
    require(index.fields.number<std::uint32_t>("ver") == 1, "is of a version that is not known");
    require(connections.count(index.fields.number<std::uint32_t>("conn")) > 0,
            "an index is of no connection");
    const auto messages = index.fields.number<std::uint32_t>("count");
    require(index.size == 12 * std::uint64_t{messages}, name_of(Kind::index) + " is damaged");
    const std::vector<char> entries = file->bytes(index.data, index.size);
    Span rest(entries.data(), entries.size());
    for (std::uint32_t k = 0; k < messages; ++k) {
      const auto seconds = rest.number<std::uint32_t>("an index");
      const auto nanoseconds = rest.number<std::uint32_t>("an index");
      require(is_time(seconds, nanoseconds), "an index has a time of 2038 or later, or none");
      found.push_back(message_at(contents, rest.number<std::uint32_t>("an index")));
    }
    place = index.end();
  }
  require_apart(found);
  for (const Extent& message : found) check_message(contents, message, connections);
}

// Before any is unpacked.
void check_sizes(File* file, const std::vector<Record>& infos) {
  std::vector<std::uint64_t> places;
  for (const Record& info : infos) {
    places.push_back(info.fields.number<std::uint64_t>("chunk_pos"));
  }
  std::sort(places.begin(), places.end());
  std::uint64_t unpacked = 0;
  std::uint64_t end = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    require(i == 0 || places[i] != places[i - 1], "it says the same chunk twice");
    require(places[i] >= end, "chunks overlap");
    const Record chunk = file->record(places[i], Kind::chunk);
    end = chunk.end();
    unpacked += unpacked_size(chunk);
  }
  require(unpacked <= kUnpacked + kUnpackedPerByte * file->size(),
          "its chunks claim to hold " + std::to_string(unpacked) +
              " bytes, too many for so small a file");
}

std::uint32_t check_connection(File* file, const Record& record) {
  const std::vector<char> data = file->bytes(record.data, record.size);
  const Fields fields{Span(data.data(), data.size())};
  for (const char* name : {"type", "md5sum", "message_definition"}) fields.text(name);
  const std::size_t longest = std::max(record.fields.longest(), fields.longest());
  if (longest > kLongestField) {
    throw Excess("a connection has a field of " + std::to_string(longest) +
                 " bytes, more than 1 MB");
  }
  record.fields.text("topic");
  return record.fields.number<std::uint32_t>("conn");
}

void check_bag(File* file) {
  const std::vector<char> magic = file->bytes(0, kMagic.size());
  require(std::string(magic.begin(), magic.end()) == kMagic,
          "is a bag of another format than 2.0; try: rosbag fix");
  const Record first = file->record(kMagic.size(), Kind::bag);
  require(!first.fields.has("encryptor") || first.fields.text("encryptor").empty(), "is encrypted");
  std::uint64_t place = first.fields.number<std::uint64_t>("index_pos");
  require(place > 0, "has no index: what recorded it did not end it");
  const auto connection_count = first.fields.number<std::uint32_t>("conn_count");
  const auto chunk_count = first.fields.number<std::uint32_t>("chunk_count");
  if (connection_count > kMostConnections) {
    throw Excess("has " + std::to_string(connection_count) + " connections, more than " +
                 std::to_string(kMostConnections));
  }
  Connections connections;
  for (std::uint32_t i = 0; i < connection_count; ++i) {
    const Record record = file->record(place, Kind::connection);
    connections.insert(check_connection(file, record));
    place = record.end();
  }
  std::vector<Record> infos;
  for (std::uint32_t i = 0; i < chunk_count; ++i) {
    infos.push_back(file->record(place, Kind::chunk_info));
    place = infos.back().end();
  }
  check_sizes(file, infos);
  for (const Record& info : infos) check_chunk(file, info, connections);
}

}  // namespace

void check_bag_structure(const std::string& path) {
  const std::string remedy = "; try: rosbag reindex " + path;
  try {
    File file(path);
    check_bag(&file);
  } catch (const Damage& damage) {
    throw Error(path + ": is truncated or damaged (" + damage.what() + ")" + remedy);
  } catch (const Excess& excess) {
    throw Error(path + ": " + excess.what());
  } catch (const rosbag::BagException& error) {
    throw Error(path + ": a chunk cannot be unpacked (" + error.what() + ")" + remedy);
  } catch (const std::filesystem::filesystem_error&) {
    throw Error(path + ": cannot be read");
  } catch (const std::exception& error) {  // no memory for what it holds
    throw Error(path + ": cannot be read (" + error.what() + ")");
  }
}

}  // namespace pf_resampling
