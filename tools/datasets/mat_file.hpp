#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>

namespace pf_resampling {

/// A MATLAB file of numeric matrices.
class MatFile {
 public:
  /// Throws Error: no such file, not a MATLAB file.
  explicit MatFile(const std::string& path);
  ~MatFile();
  MatFile(const MatFile&) = delete;
  MatFile& operator=(const MatFile&) = delete;

  /// The matrix of that name, with at least `columns` columns; nothing if it is not there. A 0 x 0
  /// matrix comes as 0 x `columns`. Throws Error: not a real numeric matrix, too few columns,
  /// damaged.
  std::optional<Eigen::MatrixXd> matrix(const std::string& name, Eigen::Index columns) const;

  /// Names of all variables, a comma between.
  std::string names() const;

 private:
  struct Handle;
  std::string path_;
  std::unique_ptr<Handle> handle_;
};

}  // namespace pf_resampling
