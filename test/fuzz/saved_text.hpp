#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/files/text_file.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"
#include "test/fuzz/fuzz_target.hpp"

namespace pf_resampling::fuzz {

/// With the line that maps and checkpoints end with, whose checksum no fuzzer guesses.
inline std::string with_end_line(std::string text) {
  if (!text.empty() && text.back() != '\n') text += '\n';
  text_file::Checksum checksum;
  checksum.add(text);
  return text + checksum.end_line(std::count(text.begin(), text.end(), '\n')) + "\n";
}

inline void require_one_line(const Error& error) {
  const std::string what = error.what();
  require(!what.empty() && what.size() < 2000 && what.find('\n') == std::string::npos,
          "an error is no line: " + what);
}

inline void surveyed_map_of(const std::string& text) {
  const SavedMap map = read_landmark_list(file_of(text), "map");
  write_map_file(new_file("surveyed"), map);
}

}  // namespace pf_resampling::fuzz
