#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace pf_resampling {

/// Cholesky's factor L·Lᵀ of a sparse symmetric matrix that is a sum of small dense terms, each
/// over a few blocks of unknowns. Multifrontal (Duff, Reid 1983; Liu 1992): columns with nearly the
/// same rows are factorised together, as a dense front, and fronts that no new term touches stay as
/// they are from one factorisation to the next. Unknowns stand in the order of elimination.
class MultifrontalCholesky {
 public:
  MultifrontalCholesky() = default;
  /// `sizes`: unknowns of each block. `terms`: the blocks of each term. Those in `last` are
  /// eliminated last, in that order, the others by approximate minimum degree.
  MultifrontalCholesky(std::vector<int> sizes, const std::vector<std::vector<int>>& terms,
                       const std::vector<int>& last);

  /// First unknown of a block.
  int at(int block) const { return at_[static_cast<std::size_t>(block)]; }
  Eigen::Index size() const { return size_; }

  /// Adds a symmetric matrix over these blocks, those of one term or some of them. A block may be
  /// there twice.
  void add(const std::vector<int>& blocks, Eigen::MatrixXd values);
  /// How many were added, and the matrix as it was after so many of them; 0: it is zero again.
  std::size_t added() const { return terms_.size(); }
  void take_back(std::size_t added);

  /// Factorises matrix + damping·diagonal. False if that is not positive definite.
  bool factorize(double damping);
  double log_determinant() const;
  /// L⁻¹·right, L⁻ᵀ·right, L·right; and with the matrix's inverse.
  Eigen::MatrixXd forward(Eigen::MatrixXd right) const;
  Eigen::MatrixXd backward(Eigen::MatrixXd right) const;
  Eigen::MatrixXd times_root(const Eigen::MatrixXd& right) const;
  Eigen::MatrixXd solve(const Eigen::MatrixXd& right) const { return backward(forward(right)); }
  /// Rows and columns of the inverse that belong to these blocks.
  Eigen::MatrixXd covariance_of(const std::vector<int>& blocks) const;
  /// Rows and columns of L from the unknown `first` on.
  Eigen::MatrixXd trailing_root(int first) const;

 private:
  struct Term {
    std::size_t front;
    std::vector<int> unknowns;
    Eigen::MatrixXd values;
  };
  // Columns that are eliminated together, and all rows in which they have entries: lower triangles.
  struct Front {
    int at = 0;  // first unknown
    Eigen::Index columns = 0;
    std::vector<int> others;  // unknowns of the other rows, ascending
    std::vector<std::size_t> children, terms;
    bool is_current = false;
    Eigen::MatrixXd matrix;  // columns of L, and behind them what the parent gets

    auto root() const { return matrix.topLeftCorner(columns, columns); }
    auto below() const { return matrix.bottomLeftCorner(matrix.rows() - columns, columns); }
    auto update() const {
      return matrix.bottomRightCorner(matrix.rows() - columns, matrix.rows() - columns);
    }
  };

  std::vector<int> unknowns_of(const std::vector<int>& blocks) const;
  Front& front_of(int unknown) { return fronts_[front_of_[static_cast<std::size_t>(unknown)]]; }
  void assemble(double damping, std::vector<Eigen::Index>* row_of, Front* front) const;

  std::vector<int> sizes_;
  std::vector<int> at_;                // of blocks
  std::vector<Front> fronts_;          // children before parents
  std::vector<std::size_t> front_of_;  // of unknowns
  std::vector<Term> terms_;
  Eigen::Index size_ = 0;
  double damping_ = 0.0;
};

}  // namespace pf_resampling
