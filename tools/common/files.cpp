#include "tools/common/files.hpp"

#include <filesystem>
#include <fstream>
#include <sstream>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/files/new_file.hpp"

namespace pf_resampling {

std::string read_file(const std::string& path) {
  require_regular_file(path, "file");
  std::ifstream stream(path, std::ios::binary);
  std::ostringstream contents;
  contents << stream.rdbuf();
  if (!stream.is_open() || stream.bad()) throw Error(path + ": cannot be read");
  return contents.str();
}

void require_regular_file(const std::string& path, const std::string& what) {
  if (!std::filesystem::exists(path)) throw Error(path + ": no such file");
  if (std::filesystem::is_directory(path)) throw Error(path + ": is a directory, not a " + what);
  if (!std::filesystem::is_regular_file(path)) {
    throw Error(path + ": is a pipe or a device, not a " + what + "; copy it into a file");
  }
}

void write_file(const std::string& path, const std::string& contents) {
  NewFile file(path, path + ":");
  file.write(contents);
  file.finish();
}

}  // namespace pf_resampling
