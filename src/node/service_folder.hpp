#pragma once

#include <string>

#include "pf_resampling_core/files/archive.hpp"

namespace pf_resampling {

/// The folder in which services write and read files that are named without one.
class ServiceFolder {
 public:
  /// `folder`: the parameter map_file/directory; "~" in front is the home of the user.
  explicit ServiceFolder(const std::string& folder);

  /// The absolute path of the file that a caller names, absolute or relative to the folder. Makes
  /// the folder if it is missing. Throws Error if that fails.
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
