#include "pf_resampling_core/smoothing/multifrontal_cholesky.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

const std::vector<int> kSizes = {3, 2, 3, 2, 2, 3, 2, 1, 2, 3, 2, 6};
// A chain, two loops, one of two tracks of a block; all touch the last block; the tenth is alone.
const std::vector<std::vector<int>> kTerms = {{0, 2, 1, 3, 11}, {2, 5, 3, 4, 4, 11}, {5, 9, 6, 11},
                                              {9, 7, 1, 11},    {7, 8, 8, 11},       {6, 1, 11}};
const std::vector<int> kLast = {5, 1, 11};

Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index columns, std::uint64_t seed) {
  const RandomStream random(seed, RandomPurpose::test, 0);
  Eigen::MatrixXd matrix(rows, columns);
  random.fill_normal(0, matrix.size(), matrix.data());
  return matrix;
}

// The same sum, sparse and dense.
struct Sum {
  MultifrontalCholesky sparse{kSizes, kTerms, kLast};
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(sparse.size(), sparse.size());

  std::vector<int> unknowns_of(const std::vector<int>& blocks) const {
    std::vector<int> unknowns;
    for (const int block : blocks) {
      for (int i = 0; i < kSizes[static_cast<std::size_t>(block)]; ++i) {
        unknowns.push_back(sparse.at(block) + i);
      }
    }
    return unknowns;
  }
  void add(const std::vector<int>& blocks, double scale, std::uint64_t seed) {
    const std::vector<int> unknowns = unknowns_of(blocks);
    const Eigen::Index size = static_cast<Eigen::Index>(unknowns.size());
    const Eigen::MatrixXd root = random_matrix(size, size, seed);
    const Eigen::MatrixXd values =
        scale * (root * root.transpose() + 0.1 * Eigen::MatrixXd::Identity(size, size));
    sparse.add(blocks, values);
    for (Eigen::Index c = 0; c < size; ++c) {
      for (Eigen::Index r = 0; r < size; ++r) {
        dense(unknowns[static_cast<std::size_t>(r)], unknowns[static_cast<std::size_t>(c)]) +=
            values(r, c);
      }
    }
  }
};

double largest(const Eigen::MatrixXd& matrix) {
  return matrix.cwiseAbs().maxCoeff();
}

void expect_factor_of(const Eigen::MatrixXd& dense, const Sum& sum) {
  const MultifrontalCholesky& sparse = sum.sparse;
  const Eigen::LLT<Eigen::MatrixXd> expected(dense);
  const Eigen::MatrixXd root = expected.matrixL();
  EXPECT_NEAR(sparse.log_determinant(), 2.0 * root.diagonal().array().log().sum(), 1e-9);
  const Eigen::MatrixXd right = random_matrix(dense.rows(), 4, 7);
  EXPECT_LT(largest(sparse.solve(right) - expected.solve(right)), 1e-9);
  EXPECT_LT(largest(sparse.times_root(right) - root * right), 1e-9);
  EXPECT_LT(largest(root * sparse.forward(right) - right), 1e-9);
  EXPECT_LT(largest(root.transpose() * sparse.backward(right) - right), 1e-9);
  const int first = sparse.at(kLast.front());
  EXPECT_LT(largest(sparse.trailing_root(first) -
                    root.bottomRightCorner(root.rows() - first, root.rows() - first)),
            1e-9);
  const Eigen::MatrixXd inverse =
      expected.solve(Eigen::MatrixXd::Identity(dense.rows(), dense.rows()));
  const std::vector<int> blocks = {8, 0, 11};
  const Eigen::MatrixXd covariance = sparse.covariance_of(blocks);
  const std::vector<int> unknowns = sum.unknowns_of(blocks);
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    for (std::size_t j = 0; j < unknowns.size(); ++j) {
      EXPECT_NEAR(covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)),
                  inverse(unknowns[i], unknowns[j]), 1e-9);
    }
  }
}

// As a dense factor of the same matrix in the same order; so, too, when what stands is used again.
TEST(MultifrontalCholesky, IsTheFactorOfTheSum) {
  Sum sum;
  for (std::size_t t = 0; t < kTerms.size(); ++t) sum.add(kTerms[t], 1.0, t);
  sum.add({10}, 1.0, 20);
  ASSERT_TRUE(sum.sparse.factorize(0.0));
  expect_factor_of(sum.dense, sum);

  Eigen::MatrixXd damped = sum.dense;
  damped.diagonal() *= 1.5;
  ASSERT_TRUE(sum.sparse.factorize(0.5));
  expect_factor_of(damped, sum);

  ASSERT_TRUE(sum.sparse.factorize(0.0));
  const std::size_t mark = sum.sparse.added();
  const Eigen::MatrixXd before = sum.dense;
  sum.add({9, 1, 11}, 1.0, 30);  // some of a term's blocks
  ASSERT_TRUE(sum.sparse.factorize(0.0));
  expect_factor_of(sum.dense, sum);
  sum.add(kTerms[1], -10.0, 1);
  EXPECT_FALSE(sum.sparse.factorize(0.0));
  sum.sparse.take_back(mark);
  ASSERT_TRUE(sum.sparse.factorize(0.0));
  expect_factor_of(before, sum);

  sum.sparse.take_back(0);
  EXPECT_FALSE(sum.sparse.factorize(0.0));
}

// Those in `last` come last, as they are given.
TEST(MultifrontalCholesky, KeepsTheOrderOfWhatIsLast) {
  const Sum sum;
  EXPECT_EQ(sum.sparse.at(11) + 6, sum.sparse.size());
  EXPECT_EQ(sum.sparse.at(1) + 2, sum.sparse.at(11));
  EXPECT_EQ(sum.sparse.at(5) + 3, sum.sparse.at(1));
}

// A processor with 32 KiB of first-level cache gave other bytes than one with 48 KiB.
TEST(MultifrontalCholesky, CachesOfTheProcessorDoNotDecideHowNumbersAreRounded) {
  EXPECT_EQ(Eigen::l1CacheSize(), 48 << 10);
  EXPECT_EQ(Eigen::l2CacheSize(), 1280 << 10);
}

}  // namespace
}  // namespace pf_resampling
