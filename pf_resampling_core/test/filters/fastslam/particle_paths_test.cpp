#include "pf_resampling_core/filters/fastslam/particle_paths.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

// Every particle with a copy of its own path: what the tree has to be equal to.
struct EagerPaths {
  void append(const Eigen::ArrayXd& x, const Eigen::ArrayXd& y, const Eigen::ArrayXd& heading) {
    paths.resize(static_cast<std::size_t>(x.size()));
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      paths[static_cast<std::size_t>(i)].push_back({x[i], y[i], heading[i]});
    }
  }
  void select(const Eigen::ArrayXi& ancestors) {
    std::vector<std::vector<Pose2>> selected;
    for (const int ancestor : ancestors) {
      selected.push_back(paths[static_cast<std::size_t>(ancestor)]);
    }
    paths = selected;
  }
  Pose2 mean(const Eigen::ArrayXd& weights, std::size_t step) const {
    double x = 0.0, y = 0.0, cosine = 0.0, sine = 0.0;
    for (std::size_t i = 0; i < paths.size(); ++i) {
      const double weight = weights[static_cast<Eigen::Index>(i)];
      x += weight * paths[i][step].x;
      y += weight * paths[i][step].y;
      cosine += weight * std::cos(paths[i][step].heading);
      sine += weight * std::sin(paths[i][step].heading);
    }
    return {x / weights.sum(), y / weights.sum(), std::atan2(sine, cosine)};
  }
  std::vector<std::vector<Pose2>> paths;
};

// Random steps and selections, with changing numbers of particles.
TEST(ParticlePaths, AreThoseOfParticlesThatKeepTheirOwn) {
  for (std::uint64_t sequence = 0; sequence < 20; ++sequence) {
    const RandomStream random(1, RandomPurpose::test, static_cast<std::uint32_t>(sequence));
    std::uint64_t next = 0;
    ParticlePaths paths;
    EagerPaths eager;
    Eigen::Index count = 20;
    const std::size_t steps = 200;
    for (std::size_t step = 0; step < steps; ++step) {
      Eigen::ArrayXd x(count), y(count), heading(count);
      for (Eigen::Index i = 0; i < count; ++i) {
        x[i] = random.normal(next++);
        y[i] = random.normal(next++);
        heading[i] = random.normal(next++);
      }
      paths.append(x, y, heading);
      eager.append(x, y, heading);
      if (random.uniform(next++) < 0.3) {
        const Eigen::Index size = 10 + static_cast<Eigen::Index>(20.0 * random.uniform(next++));
        Eigen::ArrayXi ancestors(size);
        for (Eigen::Index i = 0; i < size; ++i) {
          ancestors[i] = static_cast<int>(static_cast<double>(count) * random.uniform(next++));
        }
        paths.select(ancestors);
        eager.select(ancestors);
        count = size;
      }
    }
    Eigen::ArrayXd weights(count);
    for (Eigen::Index i = 0; i < count; ++i) weights[i] = random.uniform(next++);
    const std::vector<Pose2> mean = paths.mean(weights);
    ASSERT_EQ(mean.size(), steps);
    for (std::size_t step = 0; step < steps; ++step) {
      const Pose2 expected = eager.mean(weights, step);
      EXPECT_NEAR(mean[step].x, expected.x, 1e-12);
      EXPECT_NEAR(mean[step].y, expected.y, 1e-12);
      EXPECT_NEAR(std::remainder(mean[step].heading - expected.heading, 2.0 * kPi), 0.0, 1e-9);
    }
  }
}

// All descend from particle 0 every tenth step: what is kept is one pose a step, and the last few.
TEST(ParticlePaths, KeepOnePoseWhereAllHaveOneAncestor) {
  ParticlePaths paths;
  const Eigen::ArrayXd ones = Eigen::ArrayXd::Ones(100);
  for (int step = 0; step < 3200; ++step) {
    paths.append(step * ones, ones, ones);
    if (step % 10 == 0) paths.select(Eigen::ArrayXi::Zero(100));
  }
  EXPECT_EQ(paths.steps(), 3200u);
  EXPECT_LT(paths.size(), 3200u + 45 * 100);
  EXPECT_EQ(paths.mean(ones)[1234].x, 1234.0);
}

TEST(ParticlePaths, AreBoundedWithoutSelection) {
  ParticlePaths paths(5000);
  Eigen::ArrayXd spread(100);
  for (Eigen::Index i = 0; i < 100; ++i) spread[i] = i < 50 ? -1.0 : 1.0;
  for (int step = 0; step < 1000; ++step) paths.append(step + spread, spread, 0.0 * spread);
  EXPECT_LE(paths.size(), 1000u + 5000u + 32 * 100);
  const std::vector<Pose2> mean = paths.mean(Eigen::ArrayXd::Ones(100));
  EXPECT_NEAR(mean[10].x, 10.0, 1e-9);  // reduced to the mean
  EXPECT_NEAR(mean[999].x, 999.0, 1e-9);
}

TEST(ParticlePaths, BeginAnewWhenCleared) {
  ParticlePaths paths;
  const Eigen::ArrayXd three = Eigen::ArrayXd::Ones(3), four = Eigen::ArrayXd::Ones(4);
  EXPECT_TRUE(paths.mean(three).empty());
  paths.append(three, three, three);
  paths.clear();
  paths.append(four, four, four);
  EXPECT_EQ(paths.steps(), 1u);
}

}  // namespace
}  // namespace pf_resampling
