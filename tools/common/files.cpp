#include "tools/common/files.hpp"

#include <array>
#include <filesystem>
#include <fstream>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/files/new_file.hpp"

namespace pf_resampling {

std::string read_file(const std::string& path, std::size_t longest) {
  require_regular_file(path, "file");
  std::ifstream stream(path, std::ios::binary);
  std::string contents;
  std::array<char, 65536> block{};
  while (stream.read(block.data(), block.size()) || stream.gcount() > 0) {
    contents.append(block.data(), static_cast<std::size_t>(stream.gcount()));
    // A file in /proc may have no end, and one that is being written may grow for ever.
    if (contents.size() > longest) {
      throw Error(path + ": has more than " + std::to_string(longest) +
                  " bytes; is it the right file?");
    }
  }
  if (!stream.is_open() || stream.bad()) throw Error(path + ": cannot be read");
  return contents;
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
