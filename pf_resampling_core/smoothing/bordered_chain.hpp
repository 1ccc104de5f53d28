#pragma once

#include <Eigen/Core>

namespace pf_resampling {

/// A symmetric matrix over a chain of n poses, each tied to its neighbours, and a border of
/// unknowns that may be tied to all: block tridiagonal but for its last rows.
struct BorderedChain {
  Eigen::Matrix3Xd diagonal;  ///< n blocks side by side
  Eigen::Matrix3Xd below;     ///< of pose i + 1 and pose i
  Eigen::MatrixXd border;     ///< rows of the border, columns of the chain
  Eigen::MatrixXd corner;     ///< of the border; lower triangle

  /// `chain` = 3 n
  void set_zero(Eigen::Index chain, Eigen::Index border_size);
  /// Adds a block of the lower triangle, of one pose or of one pair of neighbours in the chain.
  template <typename Block>
  void add(Eigen::Index row, Eigen::Index column, const Block& block) {
    constexpr int kRows = Block::RowsAtCompileTime, kColumns = Block::ColsAtCompileTime;
    const Eigen::Index chain = diagonal.cols();
    if (column >= chain) {
      corner.block<kRows, kColumns>(row - chain, column - chain) += block;
    } else if (row >= chain) {
      border.block<kRows, kColumns>(row - chain, column) += block;
    } else {
      (row == column ? diagonal : below).block<kRows, kColumns>(0, column) += block;
    }
  }
  BorderedChain operator+(const BorderedChain& other) const;
  /// The chain's own part times `columns`, 3 n rows.
  Eigen::MatrixXd chain_times(const Eigen::MatrixXd& columns) const;
  /// The whole times `columns`.
  Eigen::MatrixXd times(const Eigen::MatrixXd& columns) const;
};

/// Cholesky factor of the chain of a BorderedChain, in O(n).
class ChainCholesky {
 public:
  /// With its diagonal times 1 + `damping`. False unless it is positive definite.
  bool compute(const BorderedChain& matrix, double damping = 0.0);
  /// `columns`: 3 n rows.
  Eigen::MatrixXd solve(Eigen::MatrixXd columns) const;
  double log_determinant() const;

 private:
  Eigen::Matrix3Xd root_;   // lower triangles
  Eigen::Matrix3Xd below_;  // of pose i + 1 and pose i
};

}  // namespace pf_resampling
