#include "pf_resampling_core/strategy/excitation.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

struct Cloud {
  Eigen::ArrayXd weights, x, y, heading;

  explicit Cloud(Eigen::Index size)
      : weights(Eigen::ArrayXd::Constant(size, 1.0 / static_cast<double>(size))),
        x(Eigen::ArrayXd::Zero(size)),
        y(Eigen::ArrayXd::Zero(size)),
        heading(Eigen::ArrayXd::Zero(size)) {}
};

// Correlated in all three coordinates, headings about `direction`.
Cloud random_cloud(Eigen::Index size, double direction) {
  Cloud cloud(size);
  const RandomStream stream(5, RandomPurpose::test, 1);
  for (Eigen::Index i = 0; i < size; ++i) {
    const std::uint64_t index = 4 * static_cast<std::uint64_t>(i);
    const double a = stream.normal(index), b = stream.normal(index + 1),
                 c = stream.normal(index + 2);
    cloud.x[i] = 20.0 + 3.0 * a;
    cloud.y[i] = -7.0 + 1.5 * a + 2.0 * b;
    cloud.heading[i] = std::remainder(direction + 0.1 * a - 0.1 * b + 0.2 * c, 2 * M_PI);
  }
  return cloud;
}

void skew_weights(Cloud* cloud) {
  const RandomStream stream(5, RandomPurpose::test, 2);
  for (Eigen::Index i = 0; i < cloud->weights.size(); ++i) {
    cloud->weights[i] = std::pow(stream.uniform(static_cast<std::uint64_t>(i)), 4);
  }
  cloud->weights /= cloud->weights.sum();
}

RandomStream noise(std::uint32_t step = 0) {
  return {17, RandomPurpose::excitation, step};
}

Cloud excited(const ExcitationOptions& options, Cloud cloud, std::uint32_t step = 0) {
  ExcitationWorkspace workspace;
  excite(options, cloud.weights, noise(step), {cloud.x, cloud.y, cloud.heading}, &workspace);
  return cloud;
}

Eigen::Vector3d drawn(Eigen::Index particle) {
  const std::uint64_t index = 4 * static_cast<std::uint64_t>(particle);
  return {noise().normal(index), noise().normal(index + 1), noise().normal(index + 2)};
}

// Every particle is moved by `root` times the three normals of the stream that are its own.
void expect_moved_by(const Eigen::Matrix3d& root, const Cloud& before, const Cloud& after) {
  for (Eigen::Index i = 0; i < before.x.size(); ++i) {
    const Eigen::Vector3d moved = root * drawn(i);
    EXPECT_NEAR(after.x[i], before.x[i] + moved[0], 1e-9) << i;
    EXPECT_NEAR(after.y[i], before.y[i] + moved[1], 1e-9) << i;
    const double heading = before.heading[i] + moved[2];
    EXPECT_NEAR(std::remainder(after.heading[i] - heading, 2 * M_PI), 0.0, 1e-9) << i;
  }
}

Eigen::Matrix3d diagonal(double x, double y, double heading) {
  return Eigen::Vector3d(x, y, heading).asDiagonal();
}

struct Moments {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double effective_sample_size = 0.0;
};

Moments moments_of(const Cloud& cloud) {
  Moments moments;
  const double sine = (cloud.weights * cloud.heading.sin()).sum();
  const double cosine = (cloud.weights * cloud.heading.cos()).sum();
  moments.mean << (cloud.weights * cloud.x).sum(), (cloud.weights * cloud.y).sum(),
      std::atan2(sine, cosine);
  for (Eigen::Index i = 0; i < cloud.x.size(); ++i) {
    const Eigen::Vector3d d(cloud.x[i] - moments.mean[0], cloud.y[i] - moments.mean[1],
                            std::remainder(cloud.heading[i] - moments.mean[2], 2 * M_PI));
    moments.covariance += cloud.weights[i] * d * d.transpose();
  }
  moments.effective_sample_size = 1.0 / cloud.weights.square().sum();
  return moments;
}

// Silverman (1986), eq. 4.14 and table 4.1: h = A(K) n^(-1/(d+4)), A(K) = (4/(d+2))^(1/(d+4)) for
// the Gaussian kernel; d = 3.
double silverman(double size) {
  return std::pow(0.8 / size, 1.0 / 7.0);
}

ExcitationOptions with(Excitation excitation) {
  ExcitationOptions options;
  options.method = excitation;
  return options;
}

bool same_bytes(const Cloud& a, const Cloud& b) {
  return (a.x == b.x).all() && (a.y == b.y).all() && (a.heading == b.heading).all();
}

bool all_finite(const Cloud& cloud) {
  return cloud.x.allFinite() && cloud.y.allFinite() && cloud.heading.allFinite() &&
         (cloud.heading.abs() <= M_PI + 1e-15).all();
}

TEST(Excitation, NoneLeavesEveryBit) {
  const Cloud cloud = random_cloud(100, 3.0);
  EXPECT_TRUE(same_bytes(excited(with(Excitation::none), cloud), cloud));
}

// However wide, and across pi.
TEST(Excitation, GaussianHasTheGivenDeviations) {
  const Cloud cloud = random_cloud(5000, 3.1);
  for (const double sigma_heading : {0.05, 3.0}) {
    ExcitationOptions options = with(Excitation::gaussian);
    options.sigma_position = 0.3;
    options.sigma_heading = sigma_heading;
    const Cloud after = excited(options, cloud);
    expect_moved_by(diagonal(0.3, 0.3, sigma_heading), cloud, after);
    EXPECT_TRUE(all_finite(after));
  }
}

// The bandwidth is never above one, which Silverman's is for few particles.
TEST(Excitation, RegularizedIsSilvermansBandwidthOfTheWeightedCovariance) {
  ASSERT_GT(2.0 * silverman(4.0), 1.0);
  for (const double direction : {0.5, 3.1}) {
    for (const auto& [size, scale] : {std::pair(5000, 0.7), std::pair(4, 2.0)}) {
      Cloud cloud = random_cloud(size, direction);
      if (size > 4) skew_weights(&cloud);
      const Moments moments = moments_of(cloud);
      ExcitationOptions options = with(Excitation::regularized);
      options.bandwidth_scale = scale;
      const double bandwidth = std::min(1.0, scale * silverman(moments.effective_sample_size));
      const Eigen::Matrix3d root = moments.covariance.llt().matrixL();
      expect_moved_by(bandwidth * root, cloud, excited(options, cloud));
    }
  }
}

// Gordon, Salmond, Smith (1993), section 4: sigma = K E N^(-1/d), E the distance between the
// largest and the smallest sample of the coordinate.
TEST(Excitation, RougheningIsGordonsFormula) {
  Cloud cloud(1000);
  for (Eigen::Index i = 0; i < 1000; ++i) {
    cloud.x[i] = -3.0 + 8.0 * static_cast<double>((37 * i) % 1000) / 999.0;
    cloud.y[i] = 100.0 + 0.5 * static_cast<double>((91 * i) % 1000) / 999.0;
    // 0.4 rad in all, astride of pi.
    cloud.heading[i] =
        std::remainder(M_PI - 0.3 + 0.4 * static_cast<double>((13 * i) % 1000) / 999.0, 2 * M_PI);
  }
  ExcitationOptions options = with(Excitation::roughening);
  options.roughening_scale = 0.2;
  expect_moved_by(0.2 / 10.0 * diagonal(8.0, 0.5, 0.4), cloud, excited(options, cloud));
}

TEST(Excitation, AllInOnePlaceStayThere) {
  for (const Excitation excitation : {Excitation::regularized, Excitation::roughening}) {
    for (const Eigen::Index size : {1, 2, 3, 100}) {
      Cloud cloud(size);
      cloud.x.setConstant(1234.5);
      cloud.y.setConstant(-0.25);
      cloud.heading.setConstant(3.14);
      ExcitationOptions options = with(excitation);
      options.bandwidth_scale = 2.0;
      const Cloud after = excited(options, cloud);
      ASSERT_TRUE(all_finite(after)) << to_string(excitation) << " of " << size;
      expect_moved_by(Eigen::Matrix3d::Zero(), cloud, after);
    }
  }
}

TEST(Excitation, OneParticleMayHoldAllTheWeightAndThereMayBeNone) {
  Cloud cloud = random_cloud(100, -2.0);
  cloud.weights.setZero();
  cloud.weights[3] = 1.0;
  for (const Excitation excitation : all_values<Excitation>()) {
    EXPECT_TRUE(all_finite(excited(with(excitation), cloud))) << to_string(excitation);
    EXPECT_EQ(excited(with(excitation), Cloud(0)).x.size(), 0);
  }
}

// A cloud on the line y = 2x, all headings equal, is moved along that line only.
TEST(Excitation, RegularizedStaysOnTheLineOfACollinearCloud) {
  Cloud cloud(50);
  cloud.x = Eigen::ArrayXd::LinSpaced(50, -1.0, 3.0);
  cloud.y = 2.0 * cloud.x;
  cloud.heading.setConstant(0.7);
  const Cloud after = excited(with(Excitation::regularized), cloud);
  ASSERT_TRUE(all_finite(after));
  EXPECT_GT((after.x - cloud.x).abs().maxCoeff(), 0.1);
  EXPECT_LT((after.y - 2.0 * after.x).abs().maxCoeff(), 1e-5);
  EXPECT_LT((after.heading - 0.7).abs().maxCoeff(), 1e-6);
}

TEST(Excitation, TheSameStreamGivesTheSameBytes) {
  const Cloud cloud = random_cloud(1000, 2.0);
  for (const Excitation excitation : all_values<Excitation>()) {
    const ExcitationOptions options = with(excitation);
    EXPECT_TRUE(same_bytes(excited(options, cloud), excited(options, cloud)));
    if (excitation == Excitation::none) continue;
    EXPECT_FALSE(same_bytes(excited(options, cloud), excited(options, cloud, 1)));
  }
}

}  // namespace
}  // namespace pf_resampling
