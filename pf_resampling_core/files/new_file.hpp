#pragma once

#include <string>
#include <vector>

namespace pf_resampling {

/// Throws Error unless a file of this name may be written: there is none yet, in a folder that is
/// there, or it is a regular file that is not read-only; no symbolic link. `name` is what the error
/// calls it.
void require_writable(const std::string& path, const std::string& name);

/// A file that a run reads or writes, and what errors call it: "--save-map my.map".
struct FileOfRun {
  std::string path;
  std::string name;
};

/// Throws Error, which names both, if one that is written is also read, or is written twice: the
/// same file, whatever names it has. Throws what require_writable() does.
void require_separate(const std::vector<FileOfRun>& written, const std::vector<FileOfRun>& read);

/// The file that is to have a name, made in the same folder and renamed when it is whole and on the
/// disk. It has the mode of the file that it replaces. Without finish() there is no trace of it; on
/// a file system without nameless files (O_TMPFILE), a process that is killed leaves
/// "<path>.part-<process>". Throws Error, beginning with `name`, when it cannot be written or
/// require_writable() forbids it.
class NewFile {
 public:
  NewFile(const std::string& path, const std::string& name);
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  void write(const std::string& bytes);
  /// For those who write it themselves.
  int descriptor() const { return descriptor_; }

  /// Waits until it is on the disk, and gives it its name.
  void finish();

 private:
  [[noreturn]] void refuse(int error) const;
  std::string temporary() const;

  std::string path_;
  std::string name_;
  int descriptor_ = -1;
  bool has_name_ = false;  // that of temporary()
};

}  // namespace pf_resampling
