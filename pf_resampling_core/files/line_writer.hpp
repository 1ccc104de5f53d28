#pragma once

#include <cstdint>
#include <string>

#include "pf_resampling_core/files/new_file.hpp"
#include "pf_resampling_core/files/text_file.hpp"
#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling::text_file {

/// Writes a file line by line, as a NewFile that lasts: without finish() there is no trace of it.
/// Throws Error, naming the file, when it cannot be written or a line is one that LineReader would
/// not take.
class LineWriter {
 public:
  LineWriter(const Kind& kind, const std::string& path);

  void line(const std::string& text);
  /// Writes the line with the checksum; then the file is there.
  void finish();

 private:
  void flush();

  std::string what_;
  NewFile file_;
  Checksum checksum_;
  std::string pending_;
  std::int64_t lines_ = 0;
};

/// Appends a number after a space, so that it comes back to the bit. It may be minus infinity, a
/// log-weight; any other that is not finite throws Error.
void append(double value, std::string* text);
void append(std::int64_t value, std::string* text);
void append(const Pose2& pose, std::string* text);

/// `text`, then the numbers.
template <typename... Values>
std::string line_of(std::string text, const Values&... values) {
  (append(values, &text), ...);
  return text;
}

}  // namespace pf_resampling::text_file
