#pragma once

#include <string>

#include "pf_resampling_core/files/archive.hpp"

namespace pf_resampling {

/// The folder in which services write and read files.
class ServiceFolder {
 public:
  /// `folder`: the parameter map_file/directory; "~" in front is the home of the user.
  explicit ServiceFolder(const std::string& folder);

  /// The absolute path of the file that a caller names, relative to the folder or absolute within.
  /// Makes the folder if it is missing. Throws Error if that fails, and for names that lead out of
  /// it.
  std::string path_of(const std::string& name) const;

  /// Likewise of a file that is to be written. Throws Error, too, if there is one of another kind,
  /// which is somebody's.
  std::string path_to_write(const std::string& name, const FileKind& kind) const;

  /// The absolute path of the folder, which need not exist yet.
  const std::string& path() const { return folder_; }

 private:
  std::string folder_;
};

}  // namespace pf_resampling
