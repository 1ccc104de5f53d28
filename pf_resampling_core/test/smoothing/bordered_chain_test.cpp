#include "pf_resampling_core/smoothing/bordered_chain.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

namespace pf_resampling {
namespace {

// Against Eigen's dense matrices.
TEST(BorderedChain, IsTheMatrixOfItsBlocks) {
  for (const Eigen::Index chain : {0, 3, 6, 24}) {
    constexpr Eigen::Index kBorder = 5;
    const Eigen::Index size = chain + kBorder;
    BorderedChain matrix;
    matrix.set_zero(chain, kBorder);
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(size, size);
    const auto add = [&](Eigen::Index row, Eigen::Index column, const auto& block) {
      matrix.add(row, column, block);
      dense.block(row, column, block.rows(), block.cols()) += block;
      if (row != column) dense.block(column, row, block.cols(), block.rows()) += block.transpose();
    };
    for (Eigen::Index at = 0; at <= chain; at += 3) {
      const Eigen::Matrix3d root = Eigen::Matrix3d::Random();
      add(at, at, Eigen::Matrix3d(root * root.transpose() + 9.0 * Eigen::Matrix3d::Identity()));
      if (at > 0) add(at, at - 3, Eigen::Matrix3d(Eigen::Matrix3d::Random()));
      add(chain + 3, at, Eigen::Matrix<double, 2, 3>(Eigen::Matrix<double, 2, 3>::Random()));
    }
    const Eigen::MatrixXd columns = Eigen::MatrixXd::Random(size, 4);
    EXPECT_TRUE((matrix + matrix).times(columns).isApprox(2.0 * dense * columns)) << chain;
    if (chain == 0) continue;
    ChainCholesky root;
    ASSERT_TRUE(root.compute(matrix, 0.5));
    Eigen::MatrixXd own = dense.topLeftCorner(chain, chain);
    own.diagonal() *= 1.5;
    const Eigen::MatrixXd right = columns.topRows(chain);
    EXPECT_TRUE(root.solve(right).isApprox(own.llt().solve(right))) << chain;
    EXPECT_NEAR(root.log_determinant(), std::log(own.determinant()), 1e-9) << chain;
    matrix.diagonal *= -1.0;
    EXPECT_FALSE(root.compute(matrix)) << chain;
  }
}

}  // namespace
}  // namespace pf_resampling
