#include "tools/datasets/number_table.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>

#include "pf_resampling_core/error.hpp"
#include "tools/common/files.hpp"

namespace pf_resampling {

namespace {

/// The numbers of one line; `place` names it in errors.
std::vector<double> numbers_of(const std::string& line, const std::string& place) {
  std::vector<double> numbers;
  const char* at = line.c_str();
  const auto is_space = [](char c) { return c == ' ' || c == '\t' || c == ',' || c == '\r'; };
  while (true) {
    while (is_space(*at)) ++at;
    if (*at == '\0' || *at == '#' || *at == '%') return numbers;
    char* end = nullptr;
    const double value = std::strtod(at, &end);
    const bool is_whole =
        end != at && (*end == '\0' || *end == '#' || *end == '%' || is_space(*end));
    if (!is_whole || !std::isfinite(value)) {
      const char* word_end = at;
      while (*word_end != '\0' && !is_space(*word_end)) ++word_end;
      throw Error(place + "'" + std::string(at, word_end) + "' is not a finite number");
    }
    numbers.push_back(value);
    at = end;
  }
}

}  // namespace

void NumberTable::fail(std::size_t row, const std::string& what) const {
  throw Error(path + ":" + std::to_string(rows.at(row).line) + ": " + what);
}

int NumberTable::whole_number(std::size_t row, std::size_t column) const {
  const double value = rows.at(row).numbers.at(column);
  constexpr double kLargest = std::numeric_limits<std::int32_t>::max();
  if (std::abs(value) > kLargest || std::floor(value) < value) {
    fail(row, std::to_string(value) + " is not a whole number");
  }
  return static_cast<int>(value);
}

NumberTable read_number_table(const std::string& path, std::size_t columns) {
  const std::string text = read_file(path);
  NumberTable table;
  table.path = path;
  std::size_t begin = 0;
  for (std::size_t number = 1; begin < text.size(); ++number) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string place = path + ":" + std::to_string(number) + ": ";
    std::vector<double> numbers = numbers_of(text.substr(begin, end - begin), place);
    begin = end + 1;
    if (numbers.empty()) continue;
    if (numbers.size() < columns) {
      throw Error(place + std::to_string(numbers.size()) + " numbers, " + std::to_string(columns) +
                  " are needed");
    }
    table.rows.push_back({number, std::move(numbers)});
  }
  return table;
}

}  // namespace pf_resampling
