#include "pf_resampling_core/evaluation/particle_errors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

TEST(FeatureErrorTest, IsTheRootMeanSquareOverParticlesAndLandmarks) {
  // Two particles, two landmarks: squared distances 25 and 0, 1 and 2.
  FeatureError error;
  const std::vector<double> x1 = {4.0, 1.0}, y1 = {6.0, 2.0};
  const std::vector<double> x2 = {-1.0, -1.0}, y2 = {0.0, 1.0};
  error.add({1.0, 2.0}, x1.data(), y1.data(), nullptr, 2);
  error.add({0.0, 0.0}, x2.data(), y2.data(), nullptr, 2);
  EXPECT_EQ(error.count(), 4);
  EXPECT_NEAR(error.rms(), std::sqrt(28.0 / 4.0), 1e-14);
}

TEST(FeatureErrorTest, CountsOnlyWhatParticlesHold) {
  FeatureError error;
  const std::vector<double> x = {3.0, 1e9, 0.0}, y = {4.0, 1e9, 1.0};
  const std::vector<std::uint8_t> held = {1, 0, 1};
  error.add({0.0, 0.0}, x.data(), y.data(), held.data(), 3);
  EXPECT_EQ(error.count(), 2);
  EXPECT_NEAR(error.rms(), std::sqrt(26.0 / 2.0), 1e-14);
}

TEST(FeatureErrorTest, IsZeroOfNothing) {
  EXPECT_EQ(FeatureError().rms(), 0.0);
  EXPECT_EQ(FeatureError().count(), 0);
}

TEST(PositionError, IsTheRootMeanSquareOverParticles) {
  const Eigen::Array3d x(1.0, 4.0, 1.0), y(1.0, 5.0, 3.0);
  // Squared distances from (1, 1): 0, 25, 4.
  EXPECT_NEAR(position_error({1.0, 1.0}, x, y), std::sqrt(29.0 / 3.0), 1e-14);
}

TEST(PositionError, RefusesWhatIsNoPopulation) {
  EXPECT_THROW(position_error({0.0, 0.0}, Eigen::ArrayXd(), Eigen::ArrayXd()), Error);
  EXPECT_THROW(position_error({0.0, 0.0}, Eigen::ArrayXd::Zero(2), Eigen::ArrayXd::Zero(3)), Error);
}

}  // namespace
}  // namespace pf_resampling
