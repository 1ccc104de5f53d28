#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace pf_resampling {

/// What a column of a CSV file is called, and whether it may be missing.
struct CsvColumn {
  std::string name;
  bool required = true;
};

/// A CSV file: a line that names the columns, in any order, then a line of as many fields for each
/// row. Comments (#), blank lines, spaces around fields, quotes around them, CR LF and a byte order
/// mark are passed over. Every error is one line "FILE:LINE: column NAME: VALUE ...".
class CsvTable {
 public:
  /// Reads the file. Columns of other names than `columns` are left out and listed by ignored().
  /// Throws Error: no such file, no header, more than 1000 columns, a required column missing, a
  /// column named twice, a row with another number of fields than the header.
  CsvTable(const std::string& path, const std::vector<CsvColumn>& columns);

  /// The names in the header of a file, in lower case; to tell kinds of tables apart.
  static std::vector<std::string> names_in(const std::string& path);

  std::size_t rows() const { return rows_.size(); }
  bool has(const std::string& column) const;
  const std::vector<std::string>& ignored() const { return ignored_; }

  /// The field as it stands, not empty.
  const std::string& text(std::size_t row, const std::string& column) const;
  /// A finite number.
  double number(std::size_t row, const std::string& column) const;
  /// A finite number of at least zero.
  double non_negative(std::size_t row, const std::string& column) const;
  /// A whole number of at least `least`.
  std::int32_t id(std::size_t row, const std::string& column, std::int32_t least) const;
  /// A time that ROS can hold: no more seconds than 32 bits have, before or after zero.
  double time(std::size_t row, const std::string& column = "t") const;

  /// Puts the rows in order of their times, those of equal times as they were. Returns whether they
  /// were in another. Throws as time() does.
  bool sort_by_time(const std::string& column = "t");

  /// Throws Error that names the file, the line of `row`, the column, its value and `what`.
  [[noreturn]] void fail(std::size_t row, const std::string& column, const std::string& what) const;

 private:
  struct Row {
    std::size_t line;
    std::vector<std::string> fields;
  };

  std::size_t column_index(const std::string& column) const;

  std::string path_;
  std::vector<std::string> names_;
  std::vector<std::string> ignored_;
  std::vector<Row> rows_;
};

}  // namespace pf_resampling
