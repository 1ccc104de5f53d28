#include "pf_resampling_core/strategy/excitation.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <string>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/simulation/chi_square.hpp"

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

// How each particle was moved: (x, y, heading), one row each.
Eigen::MatrixX3d moves(const Cloud& before, const Cloud& after) {
  Eigen::MatrixX3d result(before.x.size(), 3);
  for (Eigen::Index i = 0; i < before.x.size(); ++i) {
    result.row(i) << after.x[i] - before.x[i], after.y[i] - before.y[i],
        std::remainder(after.heading[i] - before.heading[i], 2 * M_PI);
  }
  return result;
}

Eigen::Vector3d drawn(Eigen::Index particle) {
  const std::uint64_t index = 4 * static_cast<std::uint64_t>(particle);
  return {noise().normal(index), noise().normal(index + 1), noise().normal(index + 2)};
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

// Three variances by chi-square, three means and three correlations as normals beyond 4.89
// deviations: false alarm 9e-6 together.
TEST(Excitation, GaussianHasTheGivenDeviations) {
  constexpr int kCount = 20000;
  ExcitationOptions options = with(Excitation::gaussian);
  options.sigma_position = 0.3;
  options.sigma_heading = 0.05;
  const Cloud cloud = random_cloud(kCount, 0.0);
  Eigen::MatrixX3d moved = moves(cloud, excited(options, cloud));
  moved.col(0) /= 0.3;
  moved.col(1) /= 0.3;
  moved.col(2) /= 0.05;
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT(std::abs(moved.col(i).sum()), kOneInAMillion * std::sqrt(kCount)) << i;
    EXPECT_TRUE(is_chi_square(moved.col(i).squaredNorm(), kCount)) << i;
    const double product = moved.col(i).dot(moved.col((i + 1) % 3));
    EXPECT_LT(std::abs(product), kOneInAMillion * std::sqrt(kCount)) << i;
  }
}

TEST(Excitation, RegularizedIsSilvermansBandwidthOfTheWeightedCovariance) {
  for (const double direction : {0.5, 3.1}) {
    Cloud cloud = random_cloud(5000, direction);
    skew_weights(&cloud);
    const Moments moments = moments_of(cloud);
    ASSERT_LT(moments.effective_sample_size, 2500.0);
    ExcitationOptions options = with(Excitation::regularized);
    options.bandwidth_scale = 0.7;
    const double bandwidth = 0.7 * silverman(moments.effective_sample_size);
    const Eigen::Matrix3d root = moments.covariance.llt().matrixL();
    const Eigen::MatrixX3d moved = moves(cloud, excited(options, cloud));
    for (Eigen::Index i = 0; i < cloud.x.size(); ++i) {
      const Eigen::Vector3d expected = bandwidth * root * drawn(i);
      ASSERT_LT((moved.row(i).transpose() - expected).norm(), 1e-9) << i;
    }
  }
}

// Whatever the draws: what is added has h^2 times the covariance of the cloud. Chi-square of 60,000
// degrees, and six products beyond 4.89 deviations: false alarm 7e-6.
TEST(Excitation, RegularizedHasTheCovarianceOfTheCloud) {
  constexpr int kCount = 20000;
  const Cloud cloud = random_cloud(kCount, -3.0);
  const Moments moments = moments_of(cloud);
  ExcitationOptions options = with(Excitation::regularized);
  options.bandwidth_scale = 1.0;
  const Eigen::Matrix3d root = moments.covariance.llt().matrixL();
  const Eigen::Matrix3d whitening = (silverman(kCount) * root).inverse();
  const Eigen::MatrixX3d white = moves(cloud, excited(options, cloud)) * whitening.transpose();
  EXPECT_TRUE(is_chi_square(white.squaredNorm(), 3.0 * kCount));
  const Eigen::Matrix3d products = white.transpose() * white / kCount;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j <= i; ++j) {
      const double deviation = std::sqrt((i == j ? 2.0 : 1.0) / kCount);
      EXPECT_NEAR(products(i, j), i == j ? 1.0 : 0.0, kOneInAMillion * deviation) << i << j;
    }
  }
}

TEST(Excitation, BandwidthIsNeverAboveOne) {
  Cloud cloud = random_cloud(4, 0.0);
  ExcitationOptions options = with(Excitation::regularized);
  options.bandwidth_scale = 2.0;
  ASSERT_GT(2.0 * silverman(4.0), 1.0);
  const Eigen::Matrix3d root = moments_of(cloud).covariance.llt().matrixL();
  const Eigen::MatrixX3d moved = moves(cloud, excited(options, cloud));
  for (Eigen::Index i = 0; i < 4; ++i) {
    Eigen::Vector3d expected = root * drawn(i);
    expected[2] = std::remainder(expected[2], 2 * M_PI);
    EXPECT_LT((moved.row(i).transpose() - expected).norm(), 1e-9);
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
  const Eigen::MatrixX3d moved = moves(cloud, excited(options, cloud));
  const Eigen::Vector3d sigma = 0.2 / 10.0 * Eigen::Vector3d(8.0, 0.5, 0.4);
  for (Eigen::Index i = 0; i < 1000; ++i) {
    const Eigen::Vector3d expected = sigma.cwiseProduct(drawn(i));
    ASSERT_LT((moved.row(i).transpose() - expected).norm(), 1e-10) << i;
  }
}

TEST(Excitation, HeadingsStayOnTheCircle) {
  ExcitationOptions options = with(Excitation::gaussian);
  options.sigma_heading = 3.0;
  const Cloud cloud = random_cloud(5000, 3.1);
  const Cloud after = excited(options, cloud);
  EXPECT_TRUE(all_finite(after));
  int wrapped = 0;
  for (Eigen::Index i = 0; i < 5000; ++i) {
    const double expected = cloud.heading[i] + 3.0 * drawn(i)[2];
    EXPECT_NEAR(std::remainder(after.heading[i] - expected, 2 * M_PI), 0.0, 1e-12);
    wrapped += std::abs(expected) > M_PI;
  }
  EXPECT_GT(wrapped, 1000);
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
      EXPECT_LT(moves(cloud, after).norm(), 1e-10) << to_string(excitation) << " of " << size;
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
