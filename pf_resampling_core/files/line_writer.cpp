#include "pf_resampling_core/files/line_writer.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling::text_file {
namespace {

constexpr std::size_t kBlock = std::size_t{1} << 20;

}  // namespace

LineWriter::LineWriter(const Kind& kind, const std::string& path)
    : what_(std::string(kind.name) + " " + path), file_(path, what_) {
  line(kind.first_line());
}

void LineWriter::line(const std::string& text) {
  ++lines_;
  if (text.size() > kLongestLine) {
    throw Error(what_ + ", line " + std::to_string(lines_) + ", is longer than the " +
                std::to_string(kLongestLine) +
                " bytes that a reader takes; take shorter names or fewer landmarks");
  }
  pending_ += text;
  pending_ += '\n';
  if (pending_.size() > kBlock) flush();
}

void LineWriter::finish() {
  flush();
  file_.write(checksum_.end_line(lines_) + "\n");
  file_.finish();
}

void LineWriter::flush() {
  checksum_.add(pending_);
  file_.write(pending_);
  pending_.clear();
}

void append(double value, std::string* text) {
  if (std::isnan(value) || value == std::numeric_limits<double>::infinity()) {
    throw Error("line to write: a number after " + printable(*text) +
                " is not finite; reset the filter");
  }
  std::array<char, 40> digits{};
  std::snprintf(digits.data(), digits.size(), " %.15g", value);
  if (std::strtod(digits.data(), nullptr) != value) {
    std::snprintf(digits.data(), digits.size(), " %.17g", value);
  }
  *text += digits.data();
}

void append(std::int64_t value, std::string* text) {
  *text += " " + std::to_string(value);
}

void append(const Pose2& pose, std::string* text) {
  for (const double value : {pose.x, pose.y, pose.heading}) append(value, text);
}

}  // namespace pf_resampling::text_file
