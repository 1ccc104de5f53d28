#include "tools/common/table.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {

namespace {

/// Characters of UTF-8 text: bytes that do not continue one.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char byte) {
    return (static_cast<unsigned char>(byte) & 0xC0U) != 0x80U;
  }));
}

/// Whether a cell goes with numbers: "-1.5 m", "~3", "?", "n/a", "-" and nothing do.
bool is_like_a_number(const std::string& cell) {
  static const std::string kOther = "+-.~<>?";
  return cell.empty() || cell == "nan" || cell == "inf" || cell == "n/a" ||
         (cell.front() >= '0' && cell.front() <= '9') ||
         kOther.find(cell.front()) != std::string::npos;
}

}  // namespace

Table::Table(std::vector<std::string> headings) : headings_(std::move(headings)) {}

void Table::add_row(std::vector<std::string> cells) {
  if (cells.size() > headings_.size()) {
    throw Error("table row with " + std::to_string(cells.size()) + " cells under " +
                std::to_string(headings_.size()) + " headings");
  }
  cells.resize(headings_.size());
  rows_.push_back(std::move(cells));
}

std::string Table::text(std::size_t indent) const {
  std::vector<std::size_t> widths;
  std::vector<bool> to_the_left;
  for (std::size_t column = 0; column < headings_.size(); ++column) {
    std::size_t width = width_of(headings_[column]);
    bool is_text = column == 0;
    for (const auto& row : rows_) {
      width = std::max(width, width_of(row[column]));
      if (!is_like_a_number(row[column])) is_text = true;
    }
    widths.push_back(width);
    to_the_left.push_back(is_text);
  }
  std::string text;
  const auto append = [&](const std::vector<std::string>& cells) {
    std::string line(indent, ' ');
    for (std::size_t column = 0; column < cells.size(); ++column) {
      const std::string padding(widths[column] - width_of(cells[column]), ' ');
      if (column > 0) line += "  ";
      line += to_the_left[column] ? cells[column] + padding : padding + cells[column];
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  };
  append(headings_);
  for (const auto& row : rows_) append(row);
  return text;
}

std::string fixed(double value, int decimals) {
  const int length = std::snprintf(nullptr, 0, "%.*f", decimals, value);
  std::string text(static_cast<std::size_t>(length) + 1, '\0');
  std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  text.resize(static_cast<std::size_t>(length));
  return text;
}

std::string joined(const std::vector<std::string>& words, const std::string& separator) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) text += (i == 0 ? "" : separator) + words[i];
  return text;
}

}  // namespace pf_resampling
