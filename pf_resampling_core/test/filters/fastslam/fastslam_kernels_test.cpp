#include "pf_resampling_core/filters/fastslam/kernels.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

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

}  // namespace
}  // namespace pf_resampling
