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

  /// First unknown of a block, and how many there are.
  int at(int block) const { return at_[static_cast<std::size_t>(block)]; }
  int size_of(int block) const { return sizes_[static_cast<std::size_t>(block)]; }
  Eigen::Index size() const { return diagonal_.size(); }

  /// The matrix is zero again.
  void clear();
  /// Adds a symmetric matrix over these blocks, those of one term or some of them. A block may be
  /// there twice.
  void add(std::vector<int> blocks, Eigen::MatrixXd values);
  /// The matrix as it is, to be taken back to once more was added.
  struct Mark {
    std::size_t terms;
    Eigen::VectorXd diagonal;
  };
  Mark mark() const { return {terms_.size(), diagonal_}; }
  void take_back(const Mark& mark);

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
    std::vector<int> blocks;
    Eigen::MatrixXd values;
  };
  // Columns that are eliminated together, and all rows in which they have entries.
  struct Front {
    int begin = 0, end = 0;       // of their blocks, in the order of elimination
    std::vector<int> others;      // blocks of the other rows, likewise, ascending
    std::vector<int> offsets;     // rows of the front at which these begin
    std::vector<int> other_rows;  // their unknowns
    std::vector<int> in_parent;   // and which rows of the parent's front these are
    std::vector<std::size_t> children;
    std::vector<std::size_t> terms;
    int at = 0;  // first unknown
    Eigen::Index columns = 0;
    bool is_current = false;
    Eigen::MatrixXd root;    // columns of L
    Eigen::MatrixXd update;  // what the parent gets, lower triangle
  };

  void order_blocks(const std::vector<std::vector<int>>& terms, const std::vector<int>& last);
  void find_fronts(const std::vector<std::vector<int>>& terms);
  void lay_out_fronts();
  int size_at(int position) const;
  int first_of(const std::vector<int>& blocks) const;
  int row_in(const Front& front, int position) const;
  void assemble(Front* front) const;

  std::vector<int> sizes_;
  std::vector<int> position_;          // of blocks in the order of elimination
  std::vector<int> block_at_;          // the other way round
  std::vector<int> at_;                // of blocks
  std::vector<Front> fronts_;          // children before parents
  std::vector<std::size_t> front_of_;  // of positions
  std::vector<Term> terms_;
  Eigen::VectorXd diagonal_;
  double damping_ = 0.0;
};

}  // namespace pf_resampling
