#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace pf_resampling {

/// A text file of numbers, a row per line, spaces, tabs or commas between. Blank lines and what
/// follows # or % are passed over.
struct NumberTable {
  struct Row {
    std::size_t line = 0;  ///< in the file, from 1
    std::vector<double> numbers;
  };
  std::string path;
  std::vector<Row> rows;

  /// Throws Error "FILE:LINE: what".
  [[noreturn]] void fail(std::size_t row, const std::string& what) const;

  /// The field as a whole number of 32 bits. Throws Error.
  int whole_number(std::size_t row, std::size_t column) const;
};

/// Reads the file; each row has at least `columns` finite numbers. Throws Error that names the file
/// and the line.
NumberTable read_number_table(const std::string& path, std::size_t columns);

}  // namespace pf_resampling
