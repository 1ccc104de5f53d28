#include "pf_resampling_core/filters/fastslam/kernels.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

// Three particles that look at a landmark ahead, all in one line with it, so that ranges are
// differences and bearings do not depend on places.
class SquaredInnovation : public testing::Test {
 protected:
  kernels::PoseGaussians pose() {
    return {x_.data(),    zero_.data(), heading_.data(), variance_.data(), zero_.data(),
            zero_.data(), zero_.data(), zero_.data(),    turns_.data()};
  }
  LandmarkRow landmark() {
    return {place_.data(), zero_.data(), around_.data(), zero_.data(),
            zero_.data(),  zero_.data(), held_.data()};
  }

  Eigen::ArrayXd weights_ = (Eigen::ArrayXd(3) << 0.5, 0.25, 0.25).finished();
  Eigen::ArrayXd x_ = (Eigen::ArrayXd(3) << 0.0, 1.0, -2.0).finished();
  Eigen::ArrayXd heading_ = (Eigen::ArrayXd(3) << 0.1, -0.1, 0.3).finished();
  Eigen::ArrayXd variance_ = Eigen::ArrayXd::Constant(3, 0.04);  // m^2, of x
  Eigen::ArrayXd turns_ = Eigen::ArrayXd::Constant(3, 0.01);     // rad^2, of the heading
  Eigen::ArrayXd place_ = (Eigen::ArrayXd(3) << 10.0, 10.0, 10.0).finished();
  Eigen::ArrayXd around_ = Eigen::ArrayXd::Constant(3, 0.09);  // m^2, of the landmark along x
  Eigen::ArrayXd zero_ = Eigen::ArrayXd::Zero(3);
  std::vector<std::uint8_t> held_ = {1, 1, 1};
  const kernels::Observation z_ = {9.5, 0.05, 0.16, 0.0025, 0.0, 0.0, 0.0};
};

// Predicted ranges 10, 9 and 12 with the variance 0.16 + 0.04 + 0.09; bearings are minus the
// headings, with 0.0025 + 0.01. The mixture's moments by hand.
TEST_F(SquaredInnovation, IsThatOfTheMixturesMoments) {
  Eigen::Matrix<double, 3, 2> errors;
  errors << -0.5, 0.15, 0.5, -0.05, -2.5, 0.35;
  const Eigen::Vector2d mean = errors.transpose() * weights_.matrix();
  Eigen::Matrix2d covariance = Eigen::Vector2d(0.29, 0.0125).asDiagonal();
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector2d off = errors.row(i).transpose() - mean;
    covariance += weights_[i] * off * off.transpose();
  }
  EXPECT_NEAR(kernels::squared_innovation(z_, weights_, pose(), landmark()),
              mean.dot(covariance.inverse() * mean), 1e-9);
}

TEST_F(SquaredInnovation, LeavesOutParticlesWithoutTheLandmark) {
  held_ = {1, 0, 0};
  place_[1] = 1e6;
  EXPECT_NEAR(kernels::squared_innovation(z_, weights_, pose(), landmark()),
              0.5 * 0.5 / 0.29 + 0.15 * 0.15 / 0.0125, 1e-9);
}

// A motion that is all but unknown along one direction: the innovation covariance is there 1e18
// times what the sensor adds, which rounding hides. No likelihood is above the peak of the sensor
// itself, and no distance below zero.
TEST(Kernels, StayFiniteWhereThePoseIsAllButUnknown) {
  constexpr int kCount = 1000;
  const kernels::Observation z = {9.5, 0.05, 0.01, 0.0025, 0.2, 0.1, 0.0};
  Eigen::ArrayXXd normals(kCount, 8);
  RandomStream(7, RandomPurpose::motion, 0).fill_normal(0, normals.size(), normals.data());
  Eigen::ArrayXXd pose = Eigen::ArrayXXd::Zero(kCount, 9);
  pose.leftCols(3) = normals.leftCols(3);
  const Eigen::ArrayXXd along = 1e8 * normals.middleCols(3, 3);
  pose.col(3) = along.col(0).square() + 1e-4;
  pose.col(4) = along.col(0) * along.col(1);
  pose.col(5) = along.col(0) * along.col(2);
  pose.col(6) = along.col(1).square() + 1e-4;
  pose.col(7) = along.col(1) * along.col(2);
  pose.col(8) = along.col(2).square() + 1e-4;
  Eigen::ArrayXXd landmark = Eigen::ArrayXXd::Zero(kCount, 5);
  landmark.leftCols(2) = 10.0 * normals.rightCols(2);
  landmark.col(2).setConstant(0.01);
  landmark.col(4).setConstant(0.01);
  std::vector<std::uint8_t> held(kCount, 1);
  const kernels::PoseGaussians gaussians = {
      pose.col(0).data(), pose.col(1).data(), pose.col(2).data(),
      pose.col(3).data(), pose.col(4).data(), pose.col(5).data(),
      pose.col(6).data(), pose.col(7).data(), pose.col(8).data()};
  const LandmarkRow row = {landmark.col(0).data(),
                           landmark.col(1).data(),
                           landmark.col(2).data(),
                           landmark.col(3).data(),
                           landmark.col(4).data(),
                           landmark.col(4).data(),
                           held.data()};
  const double peak = -std::log(2.0 * M_PI) - 0.5 * std::log(0.01 * 0.0025);
  Eigen::ArrayXd distance(kCount);
  Eigen::ArrayXd log_likelihood(kCount);
  kernels::match(z, kCount, gaussians, row, distance.data(), log_likelihood.data());
  EXPECT_TRUE(distance.allFinite() && log_likelihood.allFinite());
  EXPECT_GE(distance.minCoeff(), 0.0);
  EXPECT_LE(log_likelihood.maxCoeff(), peak + 1e-9);

  const Eigen::ArrayXd takes = Eigen::ArrayXd::Ones(kCount);
  Eigen::ArrayXd log_weight = Eigen::ArrayXd::Zero(kCount);
  Eigen::ArrayXd accepted(kCount);
  kernels::propose(z, 9.0, kCount, gaussians, row, takes.data(), log_weight.data(),
                   accepted.data());
  EXPECT_LE(log_weight.maxCoeff(), peak + 1e-9);
  const Eigen::ArrayXXd drawn = normals.leftCols(3);
  kernels::draw(kCount, drawn.col(0).data(), drawn.col(1).data(), drawn.col(2).data(), gaussians);
  EXPECT_TRUE(pose.leftCols(3).allFinite() && log_weight.allFinite());
}

}  // namespace
}  // namespace pf_resampling
