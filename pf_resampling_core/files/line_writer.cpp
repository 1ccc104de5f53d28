#include "pf_resampling_core/files/line_writer.hpp"

#include <array>
#include <cstdio>
#include <cstdlib>

namespace pf_resampling::text_file {
namespace {

constexpr std::size_t kBlock = std::size_t{1} << 20;

}  // namespace

LineWriter::LineWriter(const Kind& kind, const std::string& path)
    : file_(path, std::string(kind.name) + " " + path) {
  line(kind.first_line());
}

void LineWriter::line(const std::string& text) {
  pending_ += text;
  pending_ += '\n';
  ++lines_;
  if (pending_.size() > kBlock) flush();
}

void LineWriter::finish() {
  flush();
  file_.write(checksum_.end_line(lines_) + "\n");
  file_.finish(true);
}

void LineWriter::flush() {
  checksum_.add(pending_);
  file_.write(pending_);
  pending_.clear();
}

void append(double value, std::string* text) {
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
