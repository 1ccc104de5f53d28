#include "pf_resampling_core/files/new_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRemedy = "give a file in a folder that exists, has space and is writable";

std::string folder_of(const std::string& path) {
  const std::string folder = fs::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

std::string reason_of(int error) {
  return std::string(std::strerror(error)) + "; " + kRemedy;
}

/// Why no file of this name may be written; nothing if it may.
std::string fault_of(const std::string& path) {
  struct stat there {};
  if (lstat(path.c_str(), &there) != 0) {
    if (errno != ENOENT) return reason_of(errno);
  } else if (!S_ISREG(there.st_mode)) {
    return "it is not a regular file; give another name";
  } else if ((there.st_mode & 0222) == 0) {  // root could write it all the same
    return "it is read-only; make it writable or give another name";
  }
  return access(folder_of(path).c_str(), W_OK | X_OK) == 0 ? "" : reason_of(errno);
}

/// Whether both are one file, or would be: neither is there yet, and they have the same name in the
/// same folder.
bool are_one_file(const std::string& a, const std::string& b) {
  std::error_code unknown;
  if (fs::equivalent(a, b, unknown)) return true;
  const auto place = [&](const std::string& path) {
    return fs::weakly_canonical(fs::absolute(path, unknown), unknown);
  };
  return !fs::exists(a, unknown) && !fs::exists(b, unknown) && place(a) == place(b);
}

}  // namespace

void require_writable(const std::string& path, const std::string& name) {
  const std::string fault = fault_of(path);
  if (!fault.empty()) throw Error(name + " cannot be written: " + fault);
}

void require_separate(const std::vector<FileOfRun>& written, const std::vector<FileOfRun>& read) {
  const auto refuse_if_same = [](const FileOfRun& one, const FileOfRun& other, const char* why) {
    if (!are_one_file(one.path, other.path)) return;
    throw Error(one.name + " is the same file as " + other.name + ", which is " + why +
                "; give another name");
  };
  for (auto file = written.begin(); file != written.end(); ++file) {
    for (const FileOfRun& other : read) {
      std::error_code unknown;  // a world that is built in is no file
      if (fs::exists(other.path, unknown)) refuse_if_same(*file, other, "read");
    }
    for (auto other = written.begin(); other != file; ++other) {
      refuse_if_same(*file, *other, "written as well");
    }
    require_writable(file->path, file->name);
  }
}

NewFile::NewFile(const std::string& path, const std::string& name) : path_(path), name_(name) {
  require_writable(path_, name_);
  // Without a name until it is whole, so that nothing is left if the process ends before.
  descriptor_ = ::open(folder_of(path_).c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666);
  has_name_ = descriptor_ < 0;
  if (has_name_) {  // a file system that has no such files
    descriptor_ =
        ::open(temporary().c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0666);
  }
  if (descriptor_ < 0) refuse(errno);
  struct stat old {};
  if (lstat(path_.c_str(), &old) == 0 && fchmod(descriptor_, old.st_mode & 0777) != 0)
    refuse(errno);
}

NewFile::~NewFile() {
  if (descriptor_ >= 0) close(descriptor_);
  if (has_name_) unlink(temporary().c_str());
}

std::string NewFile::temporary() const {
  return path_ + ".part-" + std::to_string(getpid());
}

void NewFile::write(const std::string& bytes) {
  std::size_t written = 0;
  while (written < bytes.size()) {
    const ssize_t now = ::write(descriptor_, bytes.data() + written, bytes.size() - written);
    if (now < 0 && errno == EINTR) continue;
    if (now < 0) refuse(errno);
    written += static_cast<std::size_t>(now);
  }
}

void NewFile::finish() {
  if (fsync(descriptor_) != 0) refuse(errno);
  require_writable(path_, name_);  // what is there now
  if (!has_name_) {
    const std::string file = "/proc/self/fd/" + std::to_string(descriptor_);
    unlink(temporary().c_str());
    if (linkat(AT_FDCWD, file.c_str(), AT_FDCWD, temporary().c_str(), AT_SYMLINK_FOLLOW) != 0) {
      refuse(errno);
    }
    has_name_ = true;
  }
  if (std::rename(temporary().c_str(), path_.c_str()) != 0) refuse(errno);
  has_name_ = false;
}

void NewFile::refuse(int error) const {
  throw Error(name_ + " cannot be written: " + reason_of(error));
}

}  // namespace pf_resampling
