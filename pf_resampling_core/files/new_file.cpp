#include "pf_resampling_core/files/new_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <regex>

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
  const bool is_there = lstat(path.c_str(), &there) == 0;
  if (!is_there && errno != ENOENT) return reason_of(errno);
  if (is_there && S_ISLNK(there.st_mode)) {
    return "it is a symbolic link; give the name of the file it stands for";
  }
  if (is_there && !S_ISREG(there.st_mode)) {
    return std::string("it is ") + (S_ISDIR(there.st_mode) ? "a folder" : "not a regular file") +
           "; give the name of a file";
  }
  // Root could write it all the same.
  const bool has_writer = (there.st_mode & (S_IWUSR | S_IWGRP | S_IWOTH)) != 0;
  if (is_there && !(has_writer && faccessat(AT_FDCWD, path.c_str(), W_OK, AT_EACCESS) == 0)) {
    return "it is read-only; make it writable or give another name";
  }
  const std::string folder = folder_of(path);
  return faccessat(AT_FDCWD, folder.c_str(), W_OK | X_OK, AT_EACCESS) == 0 ? "" : reason_of(errno);
}

/// Whether both are one file, or would be: neither is there yet, and they have the same name in the
/// same folder.
bool are_one_file(const std::string& a, const std::string& b) {
  struct stat of_a {
  }, of_b{};
  const bool is_there = stat(a.c_str(), &of_a) == 0;
  if (is_there != (stat(b.c_str(), &of_b) == 0)) return false;
  if (!is_there) {
    if (fs::path(a).filename() != fs::path(b).filename()) return false;
    if (stat(folder_of(a).c_str(), &of_a) != 0 || stat(folder_of(b).c_str(), &of_b) != 0)
      return false;
  }
  return of_a.st_dev == of_b.st_dev && of_a.st_ino == of_b.st_ino;
}

// What a signal has to remove. Handlers may touch lock-free atomics and call unlink(), little else.
std::array<std::atomic<const char*>, 32> unfinished{};
static_assert(std::atomic<const char*>::is_always_lock_free, "a signal handler reads it");

extern "C" void remove_unfinished(int signal) {
  for (const auto& path : unfinished) {
    if (const char* const name = path.load()) unlink(name);
  }
  // Its own action is back (SA_RESETHAND): the program ends as if nothing had caught the signal.
  raise(signal);
}

/// Holds signals back: what is being created is removed by one that comes meanwhile.
class SignalsHeldBack {
 public:
  SignalsHeldBack() {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, &before_);
  }
  ~SignalsHeldBack() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalsHeldBack(const SignalsHeldBack&) = delete;
  SignalsHeldBack& operator=(const SignalsHeldBack&) = delete;

 private:
  sigset_t before_{};
};

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

UnfinishedFile::UnfinishedFile(const char* path) : path_(path) {
  for (auto& place : unfinished) {
    const char* nothing = nullptr;
    if (place.compare_exchange_strong(nothing, path_)) return;
  }
}

UnfinishedFile::~UnfinishedFile() {
  for (auto& place : unfinished) {
    const char* own = path_;
    if (place.compare_exchange_strong(own, nullptr)) return;
  }
}

void remove_unfinished_on_signals() {
  for (const int signal : {SIGALRM, SIGHUP, SIGINT, SIGPIPE, SIGQUIT, SIGTERM, SIGUSR1, SIGUSR2,
                           SIGVTALRM, SIGXCPU, SIGXFSZ}) {
    struct sigaction action {};
    if (sigaction(signal, nullptr, &action) != 0 || action.sa_handler != SIG_DFL) continue;
    action.sa_handler = remove_unfinished;
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    sigfillset(&action.sa_mask);
    sigaction(signal, &action, nullptr);
  }
}

NewFile::NewFile(const std::string& path, const std::string& name) : path_(path), name_(name) {
  require_writable(path_, name_);
  const SignalsHeldBack held;
  create();
  unfinished_.emplace(temporary_.c_str());
}

NewFile::~NewFile() {
  if (descriptor_ >= 0) close(descriptor_);
  if (unfinished_) unlink(temporary_.c_str());
}

void NewFile::create() {
  struct stat old {};
  const bool is_there = lstat(path_.c_str(), &old) == 0;
  // What another process of this number has left is passed over.
  static std::atomic<int> count{0};
  const std::string beginning = path_ + ".part-" + std::to_string(getpid()) + "-";
  do {
    temporary_ = beginning + std::to_string(++count);
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC,
                         is_there ? 0600 : 0666);
  } while (descriptor_ < 0 && errno == EEXIST);
  if (descriptor_ < 0) refuse(errno);
  if (!is_there) return;
  // As far as this user can: a file of somebody else becomes one's own.
  const bool has_owner = fchown(descriptor_, old.st_uid, old.st_gid) == 0;
  const mode_t mode = old.st_mode & (has_owner ? 07777 : 0777);
  if (fchmod(descriptor_, mode) == 0) return;
  const int error = errno;
  close(descriptor_);
  unlink(temporary_.c_str());
  refuse(error);
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

void NewFile::finish(bool lasting) {
  if (lasting && fsync(descriptor_) != 0) refuse(errno);
  const int descriptor = descriptor_;
  descriptor_ = -1;
  if (close(descriptor) != 0) refuse(errno);
  require_writable(path_, name_);  // what is there now
  if (std::rename(temporary_.c_str(), path_.c_str()) != 0) refuse(errno);
  unfinished_.reset();
  if (!lasting) return;
  // The new name has to last, too; a file system that cannot say so is no reason to fail.
  const int directory = ::open(folder_of(path_).c_str(), O_RDONLY | O_CLOEXEC);
  if (directory < 0) return;
  fsync(directory);
  close(directory);
}

void NewFile::refuse(int error) const {
  throw Error(name_ + " cannot be written: " + reason_of(error));
}

void remove_left_of(const std::string& path, const std::string& beginning) {
  const std::string name_begins = fs::path(path).filename().string() + ".part-";
  std::error_code unknown;
  std::vector<std::string> left;
  // What cannot be looked at stays.
  for (fs::directory_iterator place(folder_of(path), unknown); place != fs::directory_iterator();
       place.increment(unknown)) {
    const fs::directory_entry& entry = *place;
    const std::string name = entry.path().filename().string();
    if (name.rfind(name_begins, 0) != 0) continue;
    static const std::regex numbers("([1-9][0-9]{0,8})-[0-9]{1,9}");
    std::smatch found;
    const std::string rest = name.substr(name_begins.size());
    if (!std::regex_match(rest, found, numbers)) continue;
    const pid_t process = std::stoi(found[1]);
    const bool is_alive = process != getpid() && (kill(process, 0) == 0 || errno != ESRCH);
    if (is_alive || fs::symlink_status(entry.path(), unknown).type() != fs::file_type::regular) {
      continue;
    }
    std::ifstream stream(entry.path(), std::ios::binary);
    std::string begins(beginning.size(), '\0');
    stream.read(begins.data(), static_cast<std::streamsize>(begins.size()));
    begins.resize(static_cast<std::size_t>(stream.gcount()));
    if (begins.empty() || begins == beginning) left.push_back(entry.path().string());
  }
  for (const std::string& file : left) fs::remove(file, unknown);
}

}  // namespace pf_resampling
