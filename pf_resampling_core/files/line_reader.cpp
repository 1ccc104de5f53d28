#include "pf_resampling_core/files/line_reader.hpp"

#include <algorithm>
#include <limits>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling::text_file {

LineReader::LineReader(const Kind& kind, const std::string& path) : kind_(kind), path_(path) {
  open(kind_.name, path, &stream_);
  take_line();
  const std::string where = std::string(kind_.name) + " " + path + ", line 1";
  if (line_.rfind(kind_.first_words, 0) != 0) {
    // What is in it is nobody's business: a service answers with this.
    throw Error(where + " is not how a " + kind_.content + " begins; " + kind_.if_other);
  }
  if (line_ != kind_.first_line()) {
    throw Error(where + ": " + printable(line_) +
                " has a version that this program does not read; it reads \"" + kind_.first_line() +
                "\"; " + kind_.if_version);
  }
}

void LineReader::refuse(const std::string& fault) const {
  throw Error(std::string(kind_.name) + " " + path_ + ", line " + std::to_string(lines_) + ": " +
              fault + "; the file is damaged: " + kind_.if_damaged);
}

void LineReader::take(const std::string& keyword, std::size_t words) {
  do {
    take_line();
  } while (!line_.empty() && line_.front() == '#');
  words_.clear();
  std::size_t begin = 0;
  while (begin <= line_.size()) {
    const std::size_t end = std::min(line_.find(' ', begin), line_.size());
    words_.push_back(line_.substr(begin, end - begin));
    begin = end + 1;
  }
  if (words_.front() != keyword) {
    refuse(printable(line_) + " is where a line \"" + keyword + "\" should be");
  }
  if (words_.size() != words + 1) {
    refuse("after \"" + keyword + "\" there are " + std::to_string(words_.size() - 1) +
           " values, not " + std::to_string(words));
  }
}

std::int64_t LineReader::take_count(const std::string& keyword, std::int64_t most) {
  take(keyword, 1);
  return integer(1, most);
}

double LineReader::take_number(const std::string& keyword) {
  take(keyword, 1);
  return finite(1);
}

double LineReader::real(std::size_t i) const {
  return words_[i] == "-inf" ? -std::numeric_limits<double>::infinity() : finite(i);
}

double LineReader::finite(std::size_t i) const {
  double value = 0.0;
  if (!parse(words_[i], &value)) refuse(printable(words_[i]) + " is not a number");
  return value;
}

Pose2 LineReader::pose(std::size_t first) const {
  return {finite(first), finite(first + 1), finite(first + 2)};
}

std::int64_t LineReader::integer(std::size_t i, std::int64_t most) const {
  return integer(i, 0, most);
}

std::int64_t LineReader::integer(std::size_t i, std::int64_t least, std::int64_t most) const {
  const std::string& word = words_[i];
  const bool is_negative = least < 0 && word.rfind('-', 0) == 0;
  std::int64_t value = 0;
  const bool is_number =
      is_negative ? parse(word.substr(1), -least, &value) : parse(word, most, &value);
  if (!is_number) {
    refuse(printable(word) + " is not a whole number from " + std::to_string(least) + " to " +
           std::to_string(most));
  }
  return is_negative ? -value : value;
}

void LineReader::take_end() {
  const std::string expected = checksum_.end_line(lines_);
  take_line();
  if (line_ != expected) {
    refuse(printable(line_) + " does not fit the lines before it; the end should be \"" + expected +
           "\"");
  }
  if (stream_.peek() != std::char_traits<char>::eof()) refuse("there are more lines after the end");
}

// What the disk does not give, the standard library answers with an exception of its own.
int LineReader::next_letter() {
  try {
    return stream_.rdbuf()->sbumpc();
  } catch (const std::ios_base::failure& failure) {
    throw Error(std::string(kind_.name) + " " + path_ + " cannot be read (" + failure.what() +
                "); give one that can be read");
  }
}

void LineReader::take_line() {
  ++lines_;
  line_.clear();
  while (true) {
    const int letter = next_letter();
    if (letter == std::char_traits<char>::eof()) {
      refuse(line_.empty() && lines_ > 1
                 ? "the file ends before the " + std::string(kind_.content) + " does"
                 : "the file ends within this line");
    }
    if (letter == '\n') break;
    if (line_.size() == kLongestLine) refuse("the line is too long");
    line_ += static_cast<char>(letter);
  }
  checksum_.add(line_);
  checksum_.add("\n");
}

}  // namespace pf_resampling::text_file
