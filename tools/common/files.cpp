#include "tools/common/files.hpp"

#include <filesystem>
#include <fstream>
#include <sstream>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/files/new_file.hpp"

namespace pf_resampling {

std::string read_file(const std::string& path) {
  if (!std::filesystem::exists(path)) throw Error(path + ": no such file");
  if (std::filesystem::is_directory(path)) throw Error(path + ": is a directory, not a file");
  std::ifstream stream(path, std::ios::binary);
  std::ostringstream contents;
  if (stream.peek() != std::ifstream::traits_type::eof()) contents << stream.rdbuf();
  if (!stream.is_open() || stream.bad()) throw Error(path + ": cannot be read");
  return contents.str();
}

void require_directory(const std::string& path, const std::string& what) {
  if (!std::filesystem::exists(path)) throw Error(path + ": no such directory");
  if (!std::filesystem::is_directory(path)) {
    throw Error(path + ": is a file; give the directory with " + what);
  }
}

void write_file(const std::string& path, const std::string& contents) {
  NewFile file(path, path + ":");
  file.write(contents);
  file.finish();
}

}  // namespace pf_resampling
