#pragma once

#include <Eigen/Core>
#include <cmath>

namespace pf_resampling {

/// Lower triangular L with L·Lᵀ = covariance, for a covariance that may be singular (a place that
/// is exactly known, a motion without noise): directions without variance get a column of zeros.
inline Eigen::Matrix3d lower_root(const Eigen::Matrix3d& covariance) {
  Eigen::Matrix3d root = Eigen::Matrix3d::Zero();
  for (int column = 0; column < 3; ++column) {
    const double pivot = covariance(column, column) - root.row(column).head(column).squaredNorm();
    if (!(pivot > 1e-12 * covariance(column, column))) continue;
    root(column, column) = std::sqrt(pivot);
    for (int row = column + 1; row < 3; ++row) {
      const double explained = root.row(row).head(column).dot(root.row(column).head(column));
      root(row, column) = (covariance(row, column) - explained) / root(column, column);
    }
  }
  return root;
}

}  // namespace pf_resampling
