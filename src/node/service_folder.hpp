#pragma once

#include <cstddef>
#include <string>

#include "pf_resampling_core/files/archive.hpp"

namespace pf_resampling {

/// The folder in which services write and read files. Whoever can reach the graph can call them, so
/// they get at nothing else.
class ServiceFolder {
 public:
  /// `folder`: the parameter map_file/directory; "~" in front is the home of the user.
  explicit ServiceFolder(const std::string& folder);

  /// The absolute path of the file that a caller names, relative to the folder or absolute within.
  /// Makes the folder if it is missing. Throws Error if that fails, and for names that lead out of
  /// it, by "..", links or otherwise.
  std::string path_of(const std::string& name) const;

  /// Likewise of a file that is to be written. Throws Error, too, if there is one of another kind,
  /// which is somebody's, or if there are kMostFiles in its folder and it is none of them.
  std::string path_to_write(const std::string& name, const FileKind& kind) const;
  static constexpr std::ptrdiff_t kMostFiles = 1000;

  /// The absolute path of the folder, which need not exist yet.
  const std::string& path() const { return folder_; }

 private:
  std::string folder_;
};

/// A name for a file of a node of this name, which may be in a namespace: "robot1_fastslam".
std::string file_name_of(const std::string& node);

}  // namespace pf_resampling
