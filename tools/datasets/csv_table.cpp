#include "tools/datasets/csv_table.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <set>
#include <sstream>
#include <utility>

#include "pf_resampling_core/error.hpp"
#include "tools/common/files.hpp"

namespace pf_resampling {

namespace {

constexpr std::size_t kMostColumns = 1000;

struct Line {
  std::size_t number;
  std::string text;

  std::size_t fields() const {
    return 1 + static_cast<std::size_t>(std::count(text.begin(), text.end(), ','));
  }
};

/// Without spaces around it, and without a pair of quotes around that.
std::string trimmed(const std::string& text) {
  const char* const kSpace = " \t\r";
  const std::size_t first = text.find_first_not_of(kSpace);
  if (first == std::string::npos) return "";
  std::string inner = text.substr(first, text.find_last_not_of(kSpace) - first + 1);
  if (inner.size() >= 2 && inner.front() == '"' && inner.back() == '"') {
    inner = inner.substr(1, inner.size() - 2);
  }
  return inner;
}

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> fields;
  std::size_t begin = 0;
  while (true) {
    const std::size_t comma = line.find(',', begin);
    fields.push_back(trimmed(line.substr(begin, comma - begin)));
    if (comma == std::string::npos) return fields;
    begin = comma + 1;
  }
}

/// The lines of a file, one after the other: without comments, and those that say something.
class Lines {
 public:
  explicit Lines(const std::string& path) {
    std::string contents = read_file(path);
    const std::string kByteOrderMark = "\xEF\xBB\xBF";
    if (contents.compare(0, kByteOrderMark.size(), kByteOrderMark) == 0) contents.erase(0, 3);
    stream_.str(contents);
  }

  /// Nothing at the end.
  std::optional<Line> next() {
    for (std::string line; std::getline(stream_, line);) {
      ++number_;
      line.resize(std::min(line.find('#'), line.size()));
      if (!trimmed(line).empty()) return Line{number_, std::move(line)};
    }
    return std::nullopt;
  }

 private:
  std::istringstream stream_;
  std::size_t number_ = 0;
};

std::string lower(std::string text) {
  for (char& character : text) {
    character = static_cast<char>(std::tolower(static_cast<unsigned char>(character)));
  }
  return text;
}

bool is_number(const std::string& text) {
  char* end = nullptr;
  std::strtod(text.c_str(), &end);
  return !text.empty() && end == text.c_str() + text.size();
}

std::string joined(const std::vector<CsvColumn>& columns) {
  std::string text;
  for (const CsvColumn& column : columns) {
    text += (text.empty() ? "" : ",") + (column.required ? column.name : "[" + column.name + "]");
  }
  return text;
}

std::vector<std::string> header_of(const std::string& path, const std::optional<Line>& header) {
  if (!header) throw Error(path + ": is empty; its first line has to name the columns");
  const std::string place = path + ":" + std::to_string(header->number) + ": ";
  if (header->fields() > kMostColumns) {
    throw Error(place + std::to_string(header->fields()) + " columns, more than " +
                std::to_string(kMostColumns) + "; is it the right file?");
  }
  std::vector<std::string> names;
  std::set<std::string> known;
  for (const std::string& field : split(header->text)) {
    if (is_number(field)) {
      throw Error(place + "'" + field + "' where the name of a column is expected; " +
                  "the first line has to name the columns");
    }
    const std::string name = lower(field);
    if (name.find_first_of(";\t") != std::string::npos) {
      throw Error(place + "'" + field + "': columns have to be separated by commas");
    }
    if (!known.insert(name).second) {
      throw Error(place + "column " + name + " is named twice");
    }
    names.push_back(name);
  }
  return names;
}

}  // namespace

CsvTable::CsvTable(const std::string& path, const std::vector<CsvColumn>& columns) : path_(path) {
  Lines lines(path);
  const std::optional<Line> header = lines.next();
  names_ = header_of(path, header);
  for (const CsvColumn& column : columns) {
    if (column.required && !has(column.name)) {
      throw Error(path + ":" + std::to_string(header->number) + ": column " + column.name +
                  " is missing; the columns are " + joined(columns));
    }
  }
  for (const std::string& name : names_) {
    const bool known = std::any_of(columns.begin(), columns.end(),
                                   [&](const CsvColumn& column) { return column.name == name; });
    if (!known) ignored_.push_back(name);
  }
  while (const std::optional<Line> line = lines.next()) {
    if (line->fields() != names_.size()) {
      throw Error(path + ":" + std::to_string(line->number) + ": " +
                  std::to_string(line->fields()) + " fields, where the header names " +
                  std::to_string(names_.size()) + " columns");
    }
    rows_.push_back({line->number, split(line->text)});
  }
}

std::vector<std::string> CsvTable::names_in(const std::string& path) {
  return header_of(path, Lines(path).next());
}

bool CsvTable::has(const std::string& column) const {
  return std::find(names_.begin(), names_.end(), column) != names_.end();
}

std::size_t CsvTable::column_index(const std::string& column) const {
  const auto found = std::find(names_.begin(), names_.end(), column);
  if (found == names_.end()) throw Error(path_ + ": has no column " + column);
  return static_cast<std::size_t>(found - names_.begin());
}

const std::string& CsvTable::text(std::size_t row, const std::string& column) const {
  const std::string& field = rows_.at(row).fields[column_index(column)];
  if (field.empty()) fail(row, column, "is empty");
  return field;
}

double CsvTable::number(std::size_t row, const std::string& column) const {
  const std::string& field = text(row, column);
  if (!is_number(field)) fail(row, column, "is not a number");
  const double value = std::strtod(field.c_str(), nullptr);
  if (!std::isfinite(value)) fail(row, column, "is not finite");
  return value;
}

double CsvTable::non_negative(std::size_t row, const std::string& column) const {
  const double value = number(row, column);
  if (value < 0.0) fail(row, column, "is negative");
  return value;
}

std::int32_t CsvTable::id(std::size_t row, const std::string& column, std::int32_t least) const {
  const double value = number(row, column);
  const bool whole = std::abs(value - std::nearbyint(value)) <= 0.0;
  if (!whole || value > std::numeric_limits<std::int32_t>::max()) {
    fail(row, column, "is not a whole number");
  }
  if (value < least) fail(row, column, "is less than " + std::to_string(least));
  return static_cast<std::int32_t>(value);
}

double CsvTable::time(std::size_t row, const std::string& column) const {
  const double value = number(row, column);
  if (std::abs(value) > std::numeric_limits<std::uint32_t>::max()) {
    fail(row, column, "is beyond what ROS can hold; times are in seconds");
  }
  return value;
}

bool CsvTable::sort_by_time(const std::string& column) {
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t row = 0; row < rows_.size(); ++row) order.emplace_back(time(row, column), row);
  if (std::is_sorted(order.begin(), order.end())) return false;
  std::sort(order.begin(), order.end());
  std::vector<Row> sorted;
  for (const auto& [time, row] : order) sorted.push_back(std::move(rows_[row]));
  rows_ = std::move(sorted);
  return true;
}

void CsvTable::fail(std::size_t row, const std::string& column, const std::string& what) const {
  const Row& at = rows_.at(row);
  throw Error(path_ + ":" + std::to_string(at.line) + ": column " + column + ": '" +
              at.fields[column_index(column)] + "' " + what);
}

}  // namespace pf_resampling
