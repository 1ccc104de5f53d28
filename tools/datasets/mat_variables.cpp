#include "tools/datasets/mat_variables.hpp"

#include <zlib.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "pf_resampling_core/error.hpp"
#include "tools/common/files.hpp"

namespace pf_resampling {
namespace {

constexpr std::size_t kFileHeader = 128;     // bytes
constexpr std::size_t kTag = 8;              // type and length of what follows
constexpr std::size_t kLongestHeader = 512;  // of a variable: names have 63 characters at most
// Of kLongestHeader bytes that were compressed, with room to spare.
constexpr std::size_t kLongestCompressed = 4096;
// Deflate makes no more bytes of one.
constexpr double kMostExpansion = 1032.0;

// Types of data.
constexpr std::uint32_t kInt8 = 1;
constexpr std::uint32_t kUint8 = 2;
constexpr std::uint32_t kInt16 = 3;
constexpr std::uint32_t kUint16 = 4;
constexpr std::uint32_t kInt32 = 5;
constexpr std::uint32_t kUint32 = 6;
constexpr std::uint32_t kSingle = 7;
constexpr std::uint32_t kDouble = 9;
constexpr std::uint32_t kInt64 = 12;
constexpr std::uint32_t kUint64 = 13;
constexpr std::uint32_t kMatrix = 14;
constexpr std::uint32_t kCompressed = 15;

// Classes of arrays.
constexpr std::uint32_t kFirstNumeric = 6;
constexpr std::uint32_t kLastNumeric = 15;
constexpr std::uint32_t kOpaque = 17;

constexpr std::uint32_t kComplexFlag = 0x800;

/// Bytes of a number of a data type; 0: it is none of numbers.
std::uint64_t size_of(std::uint32_t type) {
  switch (type) {
    case kInt8:
    case kUint8:
      return 1;
    case kInt16:
    case kUint16:
      return 2;
    case kInt32:
    case kUint32:
    case kSingle:
      return 4;
    case kDouble:
    case kInt64:
    case kUint64:
      return 8;
    default:
      return 0;
  }
}

/// Reads the bytes of a file by their place.
class Bytes {
 public:
  explicit Bytes(const std::string& path)
      : path_(path), file_(path, std::ios::binary), size_(std::filesystem::file_size(path)) {}

  std::uint64_t size() const { return size_; }
  /// As many as there are, `most` at most.
  std::string at(std::uint64_t place, std::uint64_t most) {
    std::string bytes(static_cast<std::size_t>(std::min(most, size_ - place)), '\0');
    file_.seekg(static_cast<std::streamoff>(place));
    file_.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (!file_) throw Error(path_ + ": cannot be read");
    return bytes;
  }

 private:
  std::string path_;
  std::ifstream file_;
  std::uint64_t size_;
};

enum class ByteOrder { little, big };

/// The order with which the header of a file ends: 256 as an integer of two bytes, then "IM" or
/// "MI". Other files are refused: the library would take anything for version 4, which has no mark
/// of its own, and take memory for whatever lengths it sees there.
ByteOrder byte_order(Bytes* file, const std::string& path) {
  const std::string header = file->at(0, kFileHeader);
  const std::string mark = header.size() < kFileHeader ? "" : header.substr(kFileHeader - 4);
  if (mark == std::string("\0\1IM", 4)) return ByteOrder::little;
  if (mark == std::string("\1\0MI", 4)) return ByteOrder::big;
  throw Error(path + ": is not a MATLAB file of versions 5 to 7 (save it with -v7)");
}

/// Elements of a header, one after the other: type, length, data, up to the next eight bytes. One
/// of four bytes at most may have its length in the upper half of its type, and no more than
/// itself.
class Elements {
 public:
  /// `damage` is thrown where an element is not what it has to be.
  Elements(const std::string& bytes, ByteOrder order, const Error& damage)
      : bytes_(bytes), order_(order), damage_(damage) {}

  std::uint32_t number() {
    if (bytes_.size() - place_ < 4) throw Error(damage_);
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t at = place_ + (order_ == ByteOrder::big ? i : 3 - i);
      value = 256 * value + static_cast<unsigned char>(bytes_[at]);
    }
    place_ += 4;
    return value;
  }

  struct Tag {
    std::uint32_t type;
    std::uint32_t length;
    bool is_short;  // its data are in its own eight bytes
  };

  Tag tag() {
    const std::uint32_t type = number();
    if (type >> 16U == 0) return {type, number(), false};
    if (type >> 16U > 4) throw Error(damage_);
    return {type & 0xffffU, type >> 16U, true};
  }

  /// The data of an element that has to be of that type.
  std::string data(std::uint32_t type) {
    const Tag tag = this->tag();
    const std::size_t room = tag.is_short ? 4 : (std::size_t{tag.length} + 7) / 8 * 8;
    if (tag.type != type || room > bytes_.size() - place_) throw Error(damage_);
    std::string data = bytes_.substr(place_, tag.length);
    place_ += room;
    return data;
  }

  std::size_t place() const { return place_; }

 private:
  const std::string& bytes_;
  ByteOrder order_;
  const Error& damage_;
  std::size_t place_ = 0;
};

/// The first bytes of what was compressed, as many as there are or kLongestHeader.
std::string inflated(std::string compressed, const Error& damage) {
  std::string bytes(kLongestHeader, '\0');
  z_stream stream{};
  stream.next_in = reinterpret_cast<unsigned char*>(compressed.data());
  stream.avail_in = static_cast<unsigned>(compressed.size());
  stream.next_out = reinterpret_cast<unsigned char*>(bytes.data());
  stream.avail_out = static_cast<unsigned>(bytes.size());
  if (inflateInit(&stream) != Z_OK) throw std::bad_alloc();
  const int outcome = inflate(&stream, Z_SYNC_FLUSH);
  inflateEnd(&stream);
  if (outcome != Z_OK && outcome != Z_STREAM_END && outcome != Z_BUF_ERROR) throw Error(damage);
  bytes.resize(bytes.size() - stream.avail_out);
  return bytes;
}

/// What the header of a variable says. `bytes` begin behind the tag of its matrix, which says that
/// it has `length` of them.
MatVariable described(const std::string& bytes, std::uint64_t length, ByteOrder order,
                      const Error& damage) {
  MatVariable variable;
  Elements header(bytes, order, damage);
  const std::string flags = header.data(kUint32);
  if (flags.size() != 8) throw Error(damage);
  const std::uint32_t first = Elements(flags, order, damage).number();
  const std::uint32_t array_class = first & 0xffU;
  // An object of MATLAB's own: what follows is not that of a matrix.
  if (array_class == kOpaque) return variable;
  variable.is_complex = (first & kComplexFlag) != 0;
  variable.is_numeric = array_class >= kFirstNumeric && array_class <= kLastNumeric;
  const std::string dimensions = header.data(kInt32);
  if (dimensions.size() < 8 || dimensions.size() % 4 != 0) throw Error(damage);
  Elements sizes(dimensions, order, damage);
  while (sizes.place() < dimensions.size()) variable.dimensions.push_back(sizes.number());
  variable.name = header.data(kInt8);
  if (header.place() > length) throw Error(damage);

  double values = 1.0;
  for (const std::uint32_t size : variable.dimensions) values *= size;
  if (!variable.is_numeric || values == 0.0) return variable;
  const Elements::Tag data = header.tag();
  if (size_of(data.type) == 0) throw Error(damage);
  if (static_cast<double>(data.length) != values * static_cast<double>(size_of(data.type)) ||
      (!data.is_short && data.length > length - std::min<std::uint64_t>(length, header.place()))) {
    throw Error(damage);
  }
  return variable;
}

/// The variable at a place of the file.
MatVariable variable_at(std::uint64_t place, const std::string& path, ByteOrder order,
                        Bytes* file) {
  const Error truncated(path + ": is truncated");
  const Error damage(path + ": the variable at byte " + std::to_string(place) +
                     " is damaged; save the file again (with -v7)");
  const std::string tag = file->at(place, kTag);
  if (tag.size() < kTag) throw Error(truncated);
  Elements numbers(tag, order, damage);
  const std::uint32_t type = numbers.number();
  const std::uint64_t length = numbers.number();
  const std::uint64_t begin = place + kTag;
  if (length > file->size() - begin) throw Error(truncated);
  MatVariable variable;
  if (type == kMatrix) {
    variable = described(file->at(begin, std::min<std::uint64_t>(length, kLongestHeader)), length,
                         order, damage);
  } else if (type == kCompressed) {
    const std::string inner =
        inflated(file->at(begin, std::min<std::uint64_t>(length, kLongestCompressed)), damage);
    Elements matrix(inner, order, damage);
    if (matrix.number() != kMatrix) throw Error(damage);
    const std::uint64_t whole = matrix.number();
    if (static_cast<double>(whole) > kMostExpansion * static_cast<double>(length))
      throw Error(damage);
    variable = described(inner.substr(kTag), whole, order, damage);
  } else {
    throw Error(damage);
  }
  variable.place = place;
  variable.length = kTag + length;
  return variable;
}

}  // namespace

std::vector<MatVariable> variables_of_mat_file(const std::string& path) {
  require_regular_file(path, "file");
  Bytes file(path);
  const ByteOrder order = byte_order(&file, path);
  std::vector<MatVariable> variables;
  for (std::uint64_t place = kFileHeader; place < file.size();) {
    variables.push_back(variable_at(place, path, order, &file));
    place += variables.back().length;
  }
  return variables;
}

std::string file_of_variable(const std::string& path, const MatVariable& variable) {
  // The header holds where in the file more data are, which are not of this variable.
  constexpr std::size_t kPlaceOfMore = 116;
  constexpr std::size_t kLengthOfPlace = 8;
  Bytes file(path);
  std::string header = file.at(0, kFileHeader);
  header.replace(kPlaceOfMore, kLengthOfPlace, kLengthOfPlace, '\0');
  return header + file.at(variable.place, variable.length);
}

}  // namespace pf_resampling
