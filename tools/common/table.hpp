#pragma once

#include <string>
#include <vector>

namespace pf_resampling {

/// Text in aligned columns: the first to the left, and any other with a cell that is no number;
/// numbers to the right.
class Table {
 public:
  explicit Table(std::vector<std::string> headings);

  /// Adds a row; missing cells at its end stay empty. Throws Error on more cells than headings.
  void add_row(std::vector<std::string> cells);

  /// The table, a line per row, each begun with `indent` spaces. Widths count UTF-8 characters.
  std::string text(std::size_t indent = 2) const;

 private:
  std::vector<std::string> headings_;
  std::vector<std::vector<std::string>> rows_;
};

/// `value` with `decimals` digits after the point.
std::string fixed(double value, int decimals);

/// The words one after the other, the separator between.
std::string joined(const std::vector<std::string>& words, const std::string& separator);

}  // namespace pf_resampling
