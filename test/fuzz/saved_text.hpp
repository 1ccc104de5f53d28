#pragma once

#include <algorithm>
#include <string>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/files/archive.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"
#include "test/fuzz/fuzz_target.hpp"

namespace pf_resampling::fuzz {

/// With a first line of its kind, whose checksum no fuzzer guesses, in place of the one it has.
inline std::string with_first_line(const FileKind& kind, const std::string& bytes) {
  const std::string content = bytes.substr(std::min(bytes.find('\n') + 1, bytes.size()));
  return std::string(kind.format) + ' ' + checksum_of(content) + '\n' + content;
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
