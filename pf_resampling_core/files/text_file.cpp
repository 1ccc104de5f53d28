#include "pf_resampling_core/files/text_file.hpp"

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling::text_file {

std::string in_letters(std::string text) {
  for (char& letter : text) {
    if (letter < ' ' || letter > '~') letter = '?';
  }
  return text;
}

std::string printable(const std::string& text) {
  constexpr std::size_t kShown = 40;
  return '"' + in_letters(text.substr(0, kShown)) + (text.size() > kShown ? "...\"" : "\"");
}

bool parse(const std::string& word, double* value) {
  if (word.empty() || word.find_first_not_of("0123456789+-.eE") != std::string::npos) return false;
  char* end = nullptr;
  *value = std::strtod(word.c_str(), &end);
  return end == word.c_str() + word.size() && std::isfinite(*value);
}

void open(const std::string& what, const std::string& path, std::ifstream* stream) {
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored) && !std::filesystem::is_regular_file(path, ignored)) {
    throw Error(what + " " + path + " is not a file; give one that can be read");
  }
  errno = 0;
  stream->open(path, std::ios::binary);
  if (!*stream) {
    throw Error(what + " " + path + " cannot be read: " + std::strerror(errno != 0 ? errno : EIO) +
                "; give one that can be read");
  }
}

}  // namespace pf_resampling::text_file
