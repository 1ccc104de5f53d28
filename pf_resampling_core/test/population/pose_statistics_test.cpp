#include "pf_resampling_core/population/pose_statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

struct Cloud {
  Eigen::ArrayXd weights, x, y, heading;
};

// Weights far from equal, every fifth zero, headings about `direction`.
Cloud random_cloud(int size, double direction, std::uint32_t step) {
  const RandomStream stream(3, RandomPurpose::test, step);
  Cloud cloud{Eigen::ArrayXd(size), Eigen::ArrayXd(size), Eigen::ArrayXd(size),
              Eigen::ArrayXd(size)};
  for (int i = 0; i < size; ++i) {
    const std::uint64_t index = 8 * static_cast<std::uint64_t>(i);
    cloud.weights[i] = i % 5 == 4 ? 0.0 : std::pow(stream.uniform(index), 3);
    cloud.x[i] = 100.0 + 5.0 * stream.normal(index + 2);
    cloud.y[i] = -40.0 + 2.0 * stream.normal(index + 4) + 0.5 * cloud.x[i];
    cloud.heading[i] = std::remainder(
        direction + 0.4 * stream.normal(index + 6) + 0.02 * (cloud.x[i] - 100.0), 2.0 * M_PI);
  }
  cloud.weights /= cloud.weights.sum();
  return cloud;
}

// The definitions, word by word, in extended precision.
PoseStatistics reference(const Cloud& cloud) {
  long double squares = 0, x = 0, y = 0, cosine = 0, sine = 0;
  for (Eigen::Index i = 0; i < cloud.x.size(); ++i) {
    const long double w = cloud.weights[i];
    squares += w * w;
    x += w * cloud.x[i];
    y += w * cloud.y[i];
    cosine += w * std::cos(static_cast<long double>(cloud.heading[i]));
    sine += w * std::sin(static_cast<long double>(cloud.heading[i]));
  }
  PoseStatistics statistics;
  const long double heading = std::atan2(sine, cosine);
  statistics.mean = {static_cast<double>(x), static_cast<double>(y), static_cast<double>(heading)};
  statistics.effective_sample_size = static_cast<double>(1 / squares);
  for (Eigen::Index i = 0; i < cloud.x.size(); ++i) {
    const double turn = std::remainder(cloud.heading[i] - static_cast<double>(heading), 2 * M_PI);
    const Eigen::Vector3d deviation(static_cast<double>(cloud.x[i] - x),
                                    static_cast<double>(cloud.y[i] - y), turn);
    statistics.covariance += cloud.weights[i] * deviation * deviation.transpose();
  }
  return statistics;
}

PoseStatistics statistics_of(const Cloud& cloud) {
  return pose_statistics(cloud.weights, cloud.x, cloud.y, cloud.heading);
}

void expect_same(const PoseStatistics& a, const PoseStatistics& b) {
  EXPECT_NEAR(a.mean.x, b.mean.x, 1e-12 * (1 + std::abs(b.mean.x)));
  EXPECT_NEAR(a.mean.y, b.mean.y, 1e-12 * (1 + std::abs(b.mean.y)));
  EXPECT_NEAR(std::remainder(a.mean.heading - b.mean.heading, 2 * M_PI), 0.0, 1e-12);
  EXPECT_NEAR(a.effective_sample_size, b.effective_sample_size, 1e-11 * b.effective_sample_size);
  EXPECT_LT((a.covariance - b.covariance).norm(), 1e-11 * (1 + b.covariance.norm()));
}

// Sizes below, at and above the number of partial sums that run side by side.
TEST(PoseStatistics, IsTheDefinitionForAllSizes) {
  for (int size = 1; size <= 20; ++size) {
    for (const double direction : {0.0, 1.5, 3.1, -3.1}) {
      SCOPED_TRACE(testing::Message() << size << " particles about " << direction);
      const Cloud cloud = random_cloud(size, direction, static_cast<std::uint32_t>(size));
      expect_same(statistics_of(cloud), reference(cloud));
    }
  }
  const Cloud large = random_cloud(4099, 3.0, 99);
  expect_same(statistics_of(large), reference(large));
}

// Uniform over the circle: the variance of a uniform angle, pi^2 / 3, whatever the mean is taken
// for.
TEST(PoseStatistics, HeadingsAllAround) {
  const int size = 3600;
  Cloud cloud{Eigen::ArrayXd::Constant(size, 1.0 / size), Eigen::ArrayXd::Zero(size),
              Eigen::ArrayXd::Zero(size), Eigen::ArrayXd(size)};
  for (int i = 0; i < size; ++i) cloud.heading[i] = -M_PI + 2 * M_PI * (i + 0.5) / size;
  const PoseStatistics statistics = statistics_of(cloud);
  EXPECT_TRUE(std::isfinite(statistics.mean.heading));
  EXPECT_NEAR(statistics.covariance(2, 2), M_PI * M_PI / 3.0, 1e-5);
}

}  // namespace
}  // namespace pf_resampling
