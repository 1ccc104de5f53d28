#include "pf_resampling_core/smoothing/bordered_chain.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace pf_resampling {

void BorderedChain::set_zero(Eigen::Index chain, Eigen::Index border_size) {
  diagonal.setZero(3, chain);
  below.setZero(3, chain);
  border.setZero(border_size, chain);
  corner.setZero(border_size, border_size);
}

BorderedChain BorderedChain::operator+(const BorderedChain& other) const {
  return {diagonal + other.diagonal, below + other.below, border + other.border,
          corner + other.corner};
}

Eigen::MatrixXd BorderedChain::chain_times(const Eigen::MatrixXd& columns) const {
  Eigen::MatrixXd product(columns.rows(), columns.cols());
  for (Eigen::Index at = 0; at < diagonal.cols(); at += 3) {
    auto rows = product.middleRows<3>(at);
    rows.noalias() = diagonal.middleCols<3>(at) * columns.middleRows<3>(at);
    if (at > 0) rows.noalias() += below.middleCols<3>(at - 3) * columns.middleRows<3>(at - 3);
    if (at + 3 == diagonal.cols()) break;
    rows.noalias() += below.middleCols<3>(at).transpose() * columns.middleRows<3>(at + 3);
  }
  return product;
}

Eigen::MatrixXd BorderedChain::times(const Eigen::MatrixXd& columns) const {
  const Eigen::Index chain = diagonal.cols();
  Eigen::MatrixXd product(columns.rows(), columns.cols());
  product.topRows(chain) = chain_times(columns.topRows(chain));
  product.topRows(chain).noalias() += border.transpose() * columns.bottomRows(border.rows());
  product.bottomRows(border.rows()) =
      corner.selfadjointView<Eigen::Lower>() * columns.bottomRows(border.rows());
  product.bottomRows(border.rows()).noalias() += border * columns.topRows(chain);
  return product;
}

bool ChainCholesky::compute(const BorderedChain& matrix, double damping) {
  root_ = matrix.diagonal;
  below_ = matrix.below;
  for (Eigen::Index at = 0; at < root_.cols(); at += 3) {
    Eigen::Matrix3d own = root_.middleCols<3>(at);
    own.diagonal() *= 1.0 + damping;
    if (at > 0) own -= below_.middleCols<3>(at - 3) * below_.middleCols<3>(at - 3).transpose();
    const Eigen::LLT<Eigen::Matrix3d> root(own);
    if (root.info() != Eigen::Success) return false;
    root_.middleCols<3>(at) = root.matrixL();
    below_.middleCols<3>(at) =
        root.matrixL().solve(below_.middleCols<3>(at).transpose()).transpose();
  }
  return true;
}

Eigen::MatrixXd ChainCholesky::solve(Eigen::MatrixXd columns) const {
  const auto root = [&](Eigen::Index at) { return Eigen::Matrix3d(root_.middleCols<3>(at)); };
  for (Eigen::Index at = 0; at < root_.cols(); at += 3) {
    auto rows = columns.middleRows<3>(at);
    if (at > 0) rows.noalias() -= below_.middleCols<3>(at - 3) * columns.middleRows<3>(at - 3);
    root(at).triangularView<Eigen::Lower>().solveInPlace(rows);
  }
  for (Eigen::Index at = root_.cols() - 3; at >= 0; at -= 3) {
    auto rows = columns.middleRows<3>(at);
    if (at + 3 < root_.cols()) {
      rows.noalias() -= below_.middleCols<3>(at).transpose() * columns.middleRows<3>(at + 3);
    }
    root(at).transpose().triangularView<Eigen::Upper>().solveInPlace(rows);
  }
  return columns;
}

double ChainCholesky::log_determinant() const {
  double sum = 0.0;
  for (Eigen::Index i = 0; i < root_.cols(); ++i) sum += 2.0 * std::log(root_(i % 3, i));
  return sum;
}

}  // namespace pf_resampling
