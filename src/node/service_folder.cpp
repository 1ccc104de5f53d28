#include "src/node/service_folder.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

namespace fs = std::filesystem;

std::string without_tilde(const std::string& folder) {
  const bool has_tilde = folder == "~" || folder.rfind("~/", 0) == 0;
  const char* const home = std::getenv("HOME");
  return has_tilde && home != nullptr ? home + folder.substr(1) : folder;
}

}  // namespace

ServiceFolder::ServiceFolder(const std::string& folder)
    : folder_(fs::absolute(without_tilde(folder)).lexically_normal().string()) {}

std::string ServiceFolder::path_of(const std::string& name) const {
  if (name.empty()) throw Error("no file is given; give a name in " + folder_);
  std::error_code failure;
  fs::create_directories(folder_, failure);
  if (failure) {
    throw Error("the folder " + folder_ + " cannot be made: " + failure.message() +
                "; set map_file/directory to one that can");
  }
  return (fs::path(folder_) / name).lexically_normal().string();
}

std::string ServiceFolder::path_to_write(const std::string& name, const FileKind& kind) const {
  std::string path = path_of(name);
  std::error_code unknown;
  // What is no regular file is for those who write to say.
  if (fs::is_regular_file(path, unknown) && fs::file_size(path, unknown) > 0) {
    std::string begins(100, '\0');
    std::ifstream(path, std::ios::binary)
        .read(begins.data(), static_cast<std::streamsize>(begins.size()));
    if (!kind.may_begin_with(begins)) {
      throw Error("file " + path + " is there and is no " + kind.name +
                  ": give another name, or remove it");
    }
  }
  return path;
}

}  // namespace pf_resampling
