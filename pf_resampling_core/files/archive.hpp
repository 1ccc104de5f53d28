#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {

/// What a saved file is, and what errors say of it; see doc/saved_files.md.
struct FileKind {
  const char* name;     ///< "map file"
  const char* content;  ///< "map"
  const char* format;   ///< the words that name it, then its version
  bool is_text;         ///< JSON, which a person may edit; else CBOR under a line with its checksum
  const char* if_other;  ///< remedy where it is something else, or of another version
  const char* if_damaged;

  /// Whether a file of this kind, of whatever version, may begin so: with at least 100 bytes, or
  /// all of it.
  bool may_begin_with(const std::string& bytes) const;
};

inline constexpr FileKind kMapFile = {"map file",
                                      "map",
                                      "pf_resampling map 9",
                                      true,
                                      "give one that save_map wrote",
                                      "repair it, save the map again or take another copy"};
inline constexpr FileKind kCheckpointFile = {"checkpoint",
                                             "checkpoint",
                                             "pf_resampling checkpoint 16",
                                             false,
                                             "give a file that was written as a checkpoint",
                                             "take another copy or start without it"};

#define PF_RESAMPLING_FIELDS(archive, ...) (archive).fields(#__VA_ARGS__, __VA_ARGS__)

/// A tree of named values that structs are written to, or read from. A struct that is saved has one
/// description for both directions:
///
///   void describe(Archive& archive, Segment& segment) {
///     PF_RESAMPLING_FIELDS(archive, segment.poses, segment.cost);
///     archive("limit", segment.width.upper);  // by another name
///   }
///
/// Numbers, flags, names, Pose2, Eigen's matrices and arrays, and lists, arrays, options and shared
/// pointers of whatever has a description have one. Numbers come back to the bit. What a
/// description reads throws Error, in one line that names the file, the value ("tracks[3].mean")
/// and the remedy, if it is missing, of another type or size, or not finite; so does writing a
/// number that is not finite.
class Archive {
 public:
  /// An empty one, to write to.
  explicit Archive(const FileKind& kind);
  /// To read from: the tree in a file.
  Archive(const FileKind& kind, const std::string& path);
  ~Archive();
  Archive(const Archive&) = delete;
  Archive& operator=(const Archive&) = delete;

  bool is_reading() const { return is_reading_; }

  /// A field of the struct that is being described; an element of the list.
  template <typename Value>
  void operator()(const char* name, Value& value) {
    enter(name, 0);
    describe(*this, value);
    leave();
  }
  template <typename Value>
  void operator()(std::size_t element, Value& value) {
    enter(nullptr, element);
    describe(*this, value);
    leave();
  }
  /// A field that older files do not have: then the value stays.
  template <typename Value>
  void if_there(const char* name, Value& value) {
    if (!is_reading_ || has(name)) (*this)(name, value);
  }
  /// Several, by their names as they are written: "segment.poses, segment.cost_" are poses and
  /// cost.
  template <typename... Values>
  void fields(const char* written, Values&... values) {
    ((*this)(next_name(&written).c_str(), values), ...);
  }
  /// A field that nobody edits: text has its checksum beside it. Null is read whatever that says.
  template <typename Value>
  void sealed(const char* name, Value& value) {
    if (is_reading_) check_seal(name);
    (*this)(name, value);
    if (!is_reading_) seal(name);
  }
  /// A field that always has this value.
  void constant(const char* name, const std::string& value);

  // What descriptions of other than structs are made of: what stands here is ...
  /// a list; its elements come next. Returns `size`, or how many the file has.
  std::size_t list(std::size_t size);
  void list_of(std::size_t size);  ///< neither more nor less
  void number(double* value);
  std::int64_t integer(std::int64_t value, std::int64_t least, std::int64_t most);
  void flag(bool* value);
  void text(std::string* value);
  bool something(bool is_there);      ///< or nothing
  std::size_t size_of_first() const;  ///< of the lists in the list that is read

  /// Says what is wrong with what stands here.
  [[noreturn]] void refuse(const std::string& fault) const;

  /// The tree as bytes of a file: JSON or CBOR.
  std::string bytes() const;

 private:
  struct Tree;
  struct Step;

  bool has(const char* name) const;
  static std::string next_name(const char** written);
  void enter(const char* name, std::size_t element);
  void leave();
  void seal(const char* name);
  void check_seal(const char* name);

  FileKind kind_;
  std::string path_;
  bool is_reading_;
  std::unique_ptr<Tree> tree_;
  std::vector<Step> steps_;
};

inline void describe(Archive& archive, double& number) {
  archive.number(&number);
}
inline void describe(Archive& archive, bool& flag) {
  archive.flag(&flag);
}
inline void describe(Archive& archive, std::string& text) {
  archive.text(&text);
}
template <typename Integer, std::enable_if_t<std::is_integral_v<Integer>, int> = 0>
void describe(Archive& archive, Integer& integer) {
  using Limits = std::numeric_limits<Integer>;
  constexpr std::uint64_t kMost = std::numeric_limits<std::int64_t>::max();
  const auto most = std::min<std::uint64_t>(kMost, static_cast<std::uint64_t>(Limits::max()));
  integer = static_cast<Integer>(archive.integer(static_cast<std::int64_t>(integer),
                                                 static_cast<std::int64_t>(Limits::min()),
                                                 static_cast<std::int64_t>(most)));
}

/// x, y, heading.
void describe(Archive& archive, Pose2& pose);

template <typename Element>
void describe(Archive& archive, std::vector<Element>& list) {
  list.resize(archive.list(list.size()));
  for (std::size_t i = 0; i < list.size(); ++i) archive(i, list[i]);
}
inline void describe(Archive& archive, std::vector<bool>& list) {
  list.resize(archive.list(list.size()));
  for (std::size_t i = 0; i < list.size(); ++i) {
    bool element = list[i];
    archive(i, element);
    if (archive.is_reading()) list[i] = element;
  }
}
template <typename Element, std::size_t size>
void describe(Archive& archive, std::array<Element, size>& list) {
  archive.list_of(size);
  for (std::size_t i = 0; i < size; ++i) archive(i, list[i]);
}
template <typename Value>
void describe(Archive& archive, std::optional<Value>& value) {
  if (!archive.something(value.has_value())) return value.reset();
  if (!value) value.emplace();
  describe(archive, *value);
}
template <typename Value>
void describe(Archive& archive, std::shared_ptr<const Value>& value) {
  if (!archive.is_reading()) return describe(archive, const_cast<Value&>(*value));
  const auto read = std::make_shared<Value>();
  describe(archive, *read);
  value = read;
}

/// A row of a matrix.
template <typename Matrix>
struct MatrixRow {
  Matrix* matrix;
  Eigen::Index row;
};
template <typename Matrix>
void describe(Archive& archive, MatrixRow<Matrix>& row) {
  archive.list_of(static_cast<std::size_t>(row.matrix->cols()));
  for (Eigen::Index j = 0; j < row.matrix->cols(); ++j) {
    archive(static_cast<std::size_t>(j), row.matrix->coeffRef(row.row, j));
  }
}
/// A list of numbers where there is one column; else a list of rows, of which the first says how
/// many columns there are.
template <typename Matrix>
void describe(Archive& archive, Eigen::PlainObjectBase<Matrix>& matrix) {
  constexpr int kColumns = Matrix::ColsAtCompileTime;
  auto rows = static_cast<std::size_t>(matrix.rows());
  if (Matrix::RowsAtCompileTime == Eigen::Dynamic) {
    rows = archive.list(rows);
  } else {
    archive.list_of(rows);
  }
  if (archive.is_reading()) {
    const Eigen::Index columns =
        kColumns == Eigen::Dynamic ? static_cast<Eigen::Index>(archive.size_of_first()) : kColumns;
    matrix.resize(static_cast<Eigen::Index>(rows), columns);
  }
  for (std::size_t i = 0; i < rows; ++i) {
    if constexpr (kColumns == 1) {
      archive(i, matrix.coeffRef(static_cast<Eigen::Index>(i)));
    } else {
      MatrixRow<Eigen::PlainObjectBase<Matrix>> row = {&matrix, static_cast<Eigen::Index>(i)};
      archive(i, row);
    }
  }
}

/// 16 digits that another sequence of bytes has only by chance: a 64-bit FNV-1a hash.
std::string checksum_of(const std::string& bytes);

/// Writes bytes as a file that is there whole or not at all: see NewFile.
void write_bytes(const FileKind& kind, const std::string& path, const std::string& bytes);

/// Writes what has a description. Throws Error, naming the file, when it cannot be written or is
/// not finite.
template <typename Saved>
void write_saved(const FileKind& kind, const std::string& path, const Saved& saved) {
  Archive archive(kind);
  describe(archive, const_cast<Saved&>(saved));  // only reads it
  write_bytes(kind, path, archive.bytes());
}

/// Reads it. Throws Error, in one line that names file, value, fault and remedy, for anything that
/// does not fit the description.
template <typename Saved>
Saved read_saved(const FileKind& kind, const std::string& path) {
  Archive archive(kind, path);
  Saved saved;
  describe(archive, saved);
  return saved;
}

}  // namespace pf_resampling
