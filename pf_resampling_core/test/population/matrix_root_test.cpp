#include "pf_resampling_core/population/matrix_root.hpp"

#include <gtest/gtest.h>

#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

void expect_root_of(const Eigen::Matrix3d& covariance) {
  const Eigen::Matrix3d root = lower_root(covariance);
  ASSERT_TRUE(root.allFinite()) << covariance;
  EXPECT_EQ(root(0, 1), 0.0);
  EXPECT_EQ(root(0, 2), 0.0);
  EXPECT_EQ(root(1, 2), 0.0);
  EXPECT_GE(root.diagonal().minCoeff(), 0.0);
  EXPECT_LE((root * root.transpose() - covariance).norm(), 1e-9 * covariance.norm()) << covariance;
}

// Random matrices A of three rows and `rank` columns: A Aᵀ has that rank.
TEST(LowerRoot, SquaresToCovariancesOfEveryRank) {
  for (int rank = 0; rank <= 3; ++rank) {
    for (std::uint32_t trial = 0; trial < 500; ++trial) {
      Eigen::Matrix3d factor = Eigen::Matrix3d::Zero();
      RandomStream(1, RandomPurpose::test, trial).fill_normal(0, 3 * rank, factor.data());
      const Eigen::Matrix3d covariance = factor * factor.transpose();
      expect_root_of(covariance);
    }
  }
}

TEST(LowerRoot, KnownPlaceUnknownHeading) {
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  covariance(2, 2) = 9.0;
  const Eigen::Matrix3d root = lower_root(covariance);
  Eigen::Matrix3d expected = Eigen::Matrix3d::Zero();
  expected(2, 2) = 3.0;
  EXPECT_EQ(root, expected);
}

TEST(LowerRoot, VarianceLessThanZeroByRoundingIsNone) {
  Eigen::Matrix3d covariance;
  covariance << 1.0, 1.0, 0.0, 1.0, 1.0 - 1e-16, 0.0, 0.0, 0.0, -1e-30;
  const Eigen::Matrix3d root = lower_root(covariance);
  EXPECT_TRUE(root.allFinite());
  EXPECT_EQ(root(1, 1), 0.0);
  EXPECT_EQ(root(2, 2), 0.0);
}

}  // namespace
}  // namespace pf_resampling
