#pragma once

#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "pf_resampling_core/files/text_file.hpp"
#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling::text_file {

/// Takes a file line by line. All that is not as it has to be throws Error, in one line that names
/// file, line, fault and remedy.
class LineReader {
 public:
  /// Opens the file and takes its first line.
  LineReader(const Kind& kind, const std::string& path);

  [[noreturn]] void refuse(const std::string& fault) const;
  void refuse_if(const std::string& fault) const {
    if (!fault.empty()) refuse(fault);
  }

  /// Takes the next line that is no comment: `keyword` and so many words.
  void take(const std::string& keyword, std::size_t words);
  /// Likewise a line of one number: a whole one from 0 to `most`, or any that is finite.
  std::int64_t take_count(const std::string& keyword, std::int64_t most);
  double take_number(const std::string& keyword);

  /// Word `i` of that line, from 1; as a number, of which `real` may be minus infinity; as a whole
  /// number from 0 to `most`, or from `least`.
  const std::string& word(std::size_t i) const { return words_[i]; }
  double real(std::size_t i) const;
  double finite(std::size_t i) const;
  Pose2 pose(std::size_t first) const;
  std::int64_t integer(std::size_t i, std::int64_t most) const;
  std::int64_t integer(std::size_t i, std::int64_t least, std::int64_t most) const;

  /// Whether all is as it was written, and nothing comes after.
  void take_end();

 private:
  void take_line();
  int next_letter();

  Kind kind_;
  std::string path_;
  std::ifstream stream_;
  std::string line_;
  std::vector<std::string> words_;
  std::int64_t lines_ = 0;
  Checksum checksum_;
};

}  // namespace pf_resampling::text_file
