#pragma once

#include <optional>
#include <string>
#include <vector>

namespace pf_resampling {

/// Throws Error unless a file of this name may be written: there is none yet, in a folder that is
/// there, or it is a regular file that is not read-only. Never a device, a FIFO, a folder, a
/// socket, or a symbolic link, wherever it leads. `name` is what the error calls it.
void require_writable(const std::string& path, const std::string& name);

/// A file that a run reads or writes, and what errors call it: "--save-map my.map".
struct FileOfRun {
  std::string path;
  std::string name;
};

/// Throws Error, which names both, if one that is written is also read, or is written twice: the
/// same file, whatever names it has. Throws what require_writable() does.
void require_separate(const std::vector<FileOfRun>& written, const std::vector<FileOfRun>& read);

/// While it lives, remove_unfinished_on_signals() removes the file of this name. `path` has to
/// outlive it.
class UnfinishedFile {
 public:
  explicit UnfinishedFile(const char* path);
  ~UnfinishedFile();
  UnfinishedFile(const UnfinishedFile&) = delete;
  UnfinishedFile& operator=(const UnfinishedFile&) = delete;

 private:
  const char* path_;
};

/// From now on the signals that somebody sends to end a program, or that end it at a limit (SIGINT,
/// SIGQUIT, SIGTERM, SIGXCPU and the like; not SIGKILL), remove what is unfinished before they do.
/// One that is ignored, or that somebody handles already, stays so.
void remove_unfinished_on_signals();

/// The file that is to have a name, written beside it, as "<path>.part-<process>-<number>", and
/// renamed when it is whole. It has the owner and the mode of the file that it replaces. Without
/// finish() there is no trace of it. Throws Error, beginning with `name`, when it cannot be written
/// or require_writable() forbids it.
class NewFile {
 public:
  NewFile(const std::string& path, const std::string& name);
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  void write(const std::string& bytes);
  /// For those who write it themselves.
  int descriptor() const { return descriptor_; }

  /// Gives it its name. `lasting`: waits until contents and name are on the disk.
  void finish(bool lasting = false);

 private:
  [[noreturn]] void refuse(int error) const;
  void create();

  std::string path_;
  std::string name_;
  std::string temporary_;
  int descriptor_ = -1;
  std::optional<UnfinishedFile> unfinished_;
};

/// Removes what processes that were killed while they wrote `path` have left beside it: regular
/// files with the name that a NewFile has, of which the contents begin like `beginning` or are
/// empty. A process that is alive, other than this one, may still be writing.
void remove_left_of(const std::string& path, const std::string& beginning);

}  // namespace pf_resampling
