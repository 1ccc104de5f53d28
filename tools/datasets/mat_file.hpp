#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "tools/datasets/mat_variables.hpp"

namespace pf_resampling {

/// A MATLAB file of numeric matrices.
class MatFile {
 public:
  /// Throws Error: no such file, not a MATLAB file of versions 5 to 7, truncated, damaged.
  explicit MatFile(const std::string& path);

  /// The matrix of that name, with at least `columns` columns; nothing if it is not there. A 0 x 0
  /// matrix comes as 0 x `columns`. Throws Error: not a real numeric matrix, too few columns,
  /// damaged.
  std::optional<Eigen::MatrixXd> matrix(const std::string& name, Eigen::Index columns) const;

  /// Names of all variables, a comma between.
  std::string names() const;

 private:
  std::string path_;
  std::vector<MatVariable> variables_;
};

}  // namespace pf_resampling
