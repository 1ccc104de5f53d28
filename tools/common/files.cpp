#include "tools/common/files.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "pf_resampling_core/error.hpp"

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

std::string temporary_name(const std::string& path) {
  return path + ".part" + std::to_string(getpid());
}

void rename_file(const std::string& temporary, const std::string& path) {
  if (std::rename(temporary.c_str(), path.c_str()) != 0) {
    const std::string reason = std::strerror(errno);
    std::remove(temporary.c_str());
    throw Error(path + ": cannot be written: " + reason);
  }
}

void write_file(const std::string& path, const std::string& contents) {
  const std::string temporary = temporary_name(path);
  {
    std::ofstream stream(temporary, std::ios::binary);
    if (!stream) throw Error(path + ": cannot be written: " + std::strerror(errno));
    stream << contents;
    stream.close();
    if (!stream) {
      std::remove(temporary.c_str());
      throw Error(path + ": cannot be written; is the disk full?");
    }
  }
  rename_file(temporary, path);
}

}  // namespace pf_resampling
