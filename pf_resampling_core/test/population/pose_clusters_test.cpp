#include "pf_resampling_core/population/pose_clusters.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

struct Particles {
  std::vector<double> weight, x, y, heading;

  void add(double w, const Pose2& pose) {
    weight.push_back(w);
    x.push_back(pose.x);
    y.push_back(pose.y);
    heading.push_back(pose.heading);
  }
  /// `count` of a Gaussian with these standard deviations, with a weight of `w` in all.
  void add_gaussian(int count, double w, const Pose2& mean, double length, double angle,
                    std::uint64_t seed) {
    const RandomStream normals(seed, RandomPurpose::saving, 0);
    for (int i = 0; i < count; ++i) {
      const auto first = static_cast<std::uint64_t>(4 * i);
      add(w / count,
          {mean.x + length * normals.normal(first), mean.y + length * normals.normal(first + 1),
           wrap_angle(mean.heading + angle * normals.normal(first + 2))});
    }
  }
  PoseClusters clusters(int most = 10) const {
    const auto array = [](const std::vector<double>& values) {
      return Eigen::Map<const Eigen::ArrayXd>(values.data(),
                                              static_cast<Eigen::Index>(values.size()));
    };
    return pose_clusters(array(weight), array(x), array(y), array(heading), most);
  }
};

// Of the weight, where there are more particles: a pick at either end of a place.
constexpr double kPick = 2.01 / 500.0;

double sum_of(const PoseClusters& found) {
  double sum = found.rest;
  for (const PoseCluster& cluster : found.clusters) sum += cluster.weight;
  return sum;
}

// The weights are given; a mean of 300 or more is off by 6 % of sigma on average, six times that.
TEST(PoseClusters, TwoGaussiansAreTwoPlacesWithTheirWeights) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Particles particles;
    particles.add_gaussian(500, 0.61, {1.0, 3.0, 0.5}, 0.3, 0.1, seed);
    particles.add_gaussian(300, 0.39, {6.0, 1.0, -2.0}, 0.2, 0.05, seed + 100);
    const PoseClusters found = particles.clusters();
    ASSERT_EQ(found.clusters.size(), 2u) << seed;
    const PoseCluster& first = found.clusters[0];
    const PoseCluster& second = found.clusters[1];
    EXPECT_NEAR(first.weight, 0.61, 1e-9);
    EXPECT_NEAR(second.weight, 0.39, 1e-9);
    EXPECT_NEAR(found.rest, 0.0, 1e-9);
    EXPECT_NEAR(first.pose.mean.x, 1.0, 0.1);
    EXPECT_NEAR(first.pose.mean.y, 3.0, 0.1);
    EXPECT_NEAR(first.pose.mean.heading, 0.5, 0.04);
    EXPECT_NEAR(second.pose.mean.x, 6.0, 0.08);
    EXPECT_NEAR(second.pose.mean.heading, -2.0, 0.02);
    // A variance of 300 is off by 8 %; five times that.
    EXPECT_NEAR(first.pose.covariance(0, 0), 0.09, 0.036);
    EXPECT_NEAR(first.pose.covariance(2, 2), 0.01, 0.004);
    EXPECT_NEAR(second.pose.covariance(1, 1), 0.04, 0.016);
  }
}

// Of many, these are picked by their weights: a place's weight is off by a pick at most. Few heavy
// particles at one place, many light ones at the other.
TEST(PoseClusters, OfVeryManyAreThoseOfTheirWeights) {
  Particles particles;
  particles.add_gaussian(1000, 0.6, {1.0, 3.0, 0.5}, 0.3, 0.1, 1);
  particles.add_gaussian(199000, 0.4, {6.0, 1.0, -2.0}, 0.2, 0.05, 2);
  const PoseClusters found = particles.clusters();
  ASSERT_EQ(found.clusters.size(), 2u);
  EXPECT_NEAR(found.clusters[0].weight, 0.6, kPick);
  EXPECT_NEAR(found.clusters[1].weight, 0.4, kPick);
  // A mean of 1000 is off by 3 % of sigma, a variance by 4.5 %; six times that.
  EXPECT_NEAR(found.clusters[0].pose.mean.x, 1.0, 0.06);
  EXPECT_NEAR(found.clusters[0].pose.covariance(0, 0), 0.09, 0.025);
  EXPECT_NEAR(found.clusters[1].pose.mean.heading, -2.0, 0.006);
}

// In whatever order they come: in turns, too, of any number.
TEST(PoseClusters, OfManyNoPlaceIsPassedOver) {
  for (const int turns : {2, 3, 4, 10}) {
    Particles particles;
    const RandomStream normals(7, RandomPurpose::saving, 0);
    for (int i = 0; i < 10000; ++i) {
      const auto first = static_cast<std::uint64_t>(4 * i);
      particles.add(1.0, {(i % turns == 0 ? 9.0 : 0.0) + 0.3 * normals.normal(first),
                          0.3 * normals.normal(first + 1), 0.1 * normals.normal(first + 2)});
    }
    const PoseClusters found = particles.clusters();
    ASSERT_EQ(found.clusters.size(), 2u) << turns;
    // Of 500 picks that knew nothing of the order: four standard deviations.
    const double share = 1.0 / turns;
    EXPECT_NEAR(found.clusters[1].weight, share, 4.0 * std::sqrt(share * (1.0 - share) / 500.0));
  }
}

// Of any size: 30 to 30,000 particles, a table or a town.
TEST(PoseClusters, OneGaussianIsOnePlace) {
  for (const double scale : {0.01, 1.0, 300.0}) {
    for (const int count : {30, 100, 1000, 30000}) {
      for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        Particles particles;
        particles.add_gaussian(count, 2.0, {4.0, -7.0, 1.0}, scale, 0.2, seed);
        const PoseClusters found = particles.clusters();
        ASSERT_EQ(found.clusters.size(), 1u) << scale << " " << count << " " << seed;
        EXPECT_GT(found.clusters[0].weight, 0.97);
        EXPECT_NEAR(sum_of(found), 1.0, 1e-12);
      }
      if (count == 30000) break;
    }
  }
}

TEST(PoseClusters, ARingIsOnePlace) {
  for (const int count : {200, 2000}) {
    Particles along;
    Particles same;
    const RandomStream normals(7, RandomPurpose::saving, 0);
    for (int i = 0; i < count; ++i) {
      const auto first = static_cast<std::uint64_t>(4 * i);
      const double angle = 2.0 * kPi * i / count;
      const double radius = 5.0 + 0.1 * normals.normal(first);
      const Pose2 pose = {radius * std::cos(angle), radius * std::sin(angle),
                          wrap_angle(angle + 0.1 * normals.normal(first + 1))};
      along.add(1.0, pose);
      same.add(1.0, {pose.x, pose.y, 0.1 * normals.normal(first + 2)});
    }
    for (const Particles* particles : {&along, &same}) {
      const PoseClusters found = particles->clusters();
      ASSERT_EQ(found.clusters.size(), 1u) << count;
      EXPECT_GT(found.clusters[0].weight, 0.97);
      EXPECT_NEAR(found.clusters[0].pose.mean.x, 0.0, 0.2);
      // Of a ring: half the square of its radius.
      EXPECT_NEAR(found.clusters[0].pose.covariance(0, 0), 12.5, 0.5);
    }
  }
}

TEST(PoseClusters, AHeadingAcrossPiIsOnePlace) {
  Particles particles;
  particles.add_gaussian(1000, 1.0, {0.0, 0.0, kPi}, 0.2, 0.2, 3);
  const PoseClusters found = particles.clusters();
  ASSERT_EQ(found.clusters.size(), 1u);
  EXPECT_NEAR(std::abs(found.clusters[0].pose.mean.heading), kPi, 0.04);
  EXPECT_NEAR(found.clusters[0].pose.covariance(2, 2), 0.04, 0.01);
  // Beside another elsewhere, too.
  particles.add_gaussian(1000, 1.0, {9.0, 0.0, 0.0}, 0.2, 0.2, 4);
  const PoseClusters both = particles.clusters();
  ASSERT_EQ(both.clusters.size(), 2u);
  for (const PoseCluster& cluster : both.clusters) {
    EXPECT_NEAR(cluster.weight, 0.5, 1e-9);
    EXPECT_NEAR(cluster.pose.covariance(2, 2), 0.04, 0.01);
  }
}

// Forwards and backwards fit equally well.
TEST(PoseClusters, TwoHeadingsAtOnePlaceAreTwo) {
  Particles particles;
  particles.add_gaussian(400, 0.7, {2.0, 2.0, kPi - 0.1}, 0.3, 0.15, 5);
  particles.add_gaussian(400, 0.3, {2.0, 2.0, -0.1}, 0.3, 0.15, 6);
  const PoseClusters found = particles.clusters();
  ASSERT_EQ(found.clusters.size(), 2u);
  EXPECT_NEAR(found.clusters[0].weight, 0.7, kPick);
  EXPECT_NEAR(found.clusters[1].pose.mean.heading, -0.1, 0.05);
}

// Two doors of one corridor, 1 m apart, in a hall of 100 m with others far away.
TEST(PoseClusters, PlacesThatAreCloseAreToldApartInALargeArea) {
  Particles particles;
  const std::vector<std::pair<double, Pose2>> places = {{0.4, {0.0, 0.0, 0.0}},
                                                        {0.3, {1.0, 0.0, 0.0}},
                                                        {0.2, {90.0, 80.0, 2.0}},
                                                        {0.1, {-60.0, 70.0, -2.0}}};
  std::uint64_t seed = 10;
  for (const auto& [w, pose] : places) particles.add_gaussian(500, w, pose, 0.08, 0.05, ++seed);
  const PoseClusters found = particles.clusters();
  ASSERT_EQ(found.clusters.size(), 4u);
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_NEAR(found.clusters[i].weight, places[i].first, kPick);
    EXPECT_NEAR(found.clusters[i].pose.mean.x, places[i].second.x, 0.03);
    EXPECT_NEAR(found.clusters[i].pose.mean.y, places[i].second.y, 0.03);
  }
}

// Particles that recovery has strewn everywhere are no places, and do not widen the one there is.
TEST(PoseClusters, WhatIsStrewnIsInTheRest) {
  Particles particles;
  particles.add_gaussian(1000, 0.95, {3.0, 4.0, 0.0}, 0.1, 0.05, 8);
  const RandomStream uniforms(9, RandomPurpose::saving, 0);
  for (int i = 0; i < 50; ++i) {
    const auto first = static_cast<std::uint64_t>(4 * i);
    particles.add(
        0.001, {100.0 * uniforms.uniform(first) - 50.0, 100.0 * uniforms.uniform(first + 1) - 50.0,
                2.0 * kPi * uniforms.uniform(first + 2) - kPi});
  }
  const PoseClusters found = particles.clusters();
  ASSERT_EQ(found.clusters.size(), 1u);
  EXPECT_NEAR(found.clusters[0].weight, 0.95, 0.003);
  EXPECT_NEAR(found.rest, 0.05, 0.003);
  EXPECT_NEAR(found.clusters[0].pose.covariance(0, 0), 0.01, 0.002);
}

TEST(PoseClusters, GivesTheHeaviestAndTheRestOfMany) {
  Particles particles;
  for (int i = 0; i < 12; ++i) {
    // 1/78, 2/78, ... 12/78; the first is below 2 %.
    particles.add_gaussian(200, (i + 1) / 78.0, {20.0 * (i % 4), 20.0 * (i / 4), 0.3 * i}, 0.1,
                           0.02, static_cast<std::uint64_t>(20 + i));
  }
  const PoseClusters found = particles.clusters(10);
  ASSERT_EQ(found.clusters.size(), 10u);
  for (int i = 0; i < 10; ++i) {
    EXPECT_NEAR(found.clusters[static_cast<std::size_t>(i)].weight, (12 - i) / 78.0, kPick);
  }
  EXPECT_NEAR(found.rest, 3.0 / 78.0, kPick);
  EXPECT_EQ(particles.clusters(3).clusters.size(), 3u);
  EXPECT_NEAR(particles.clusters(3).rest, 1.0 - 33.0 / 78.0, kPick);
}

TEST(PoseClusters, StandsParticlesThatAreAlikeOrHaveNoWeight) {
  Particles one;
  one.add(1.0, {1.0, 2.0, 3.0});
  ASSERT_EQ(one.clusters().clusters.size(), 1u);
  EXPECT_EQ(one.clusters().clusters[0].pose.mean.y, 2.0);
  Particles alike;
  for (int i = 0; i < 100; ++i) alike.add(i < 50 ? 0.0 : 1.0, {1.0, 2.0, 3.0});
  ASSERT_EQ(alike.clusters().clusters.size(), 1u);
  EXPECT_EQ(alike.clusters().clusters[0].weight, 1.0);
  EXPECT_TRUE(alike.clusters().clusters[0].pose.covariance.allFinite());
  Particles none;
  none.add(0.0, {});
  EXPECT_TRUE(none.clusters().clusters.empty());
  EXPECT_EQ(none.clusters().rest, 1.0);
  // One that carries nearly all the weight says nothing of how far the others are off.
  Particles few;
  few.add(0.6, {0.0, 0.0, 0.0});
  few.add(0.4, {0.3, 0.0, 0.0});
  EXPECT_EQ(few.clusters().clusters.size(), 1u);
}

TEST(PoseClusters, TheSentenceSaysWherePlacesAre) {
  PoseClusters found;
  const auto at = [](double weight, const Pose2& mean) {
    PoseCluster cluster;
    cluster.weight = weight;
    cluster.pose.mean = mean;
    return cluster;
  };
  found.clusters.push_back(at(0.61, {1.2, 3.4, 0.5}));
  EXPECT_EQ(sentence_of(found), "");
  found.clusters.push_back(at(0.39, {-5.0, 2.0, -1.0}));
  EXPECT_EQ(sentence_of(found),
            "2 places fit: 61 % at (1.20, 3.40) m, 0.50 rad; 39 % at (-5.00, 2.00) m, -1.00 rad");
  // Eight centimetres beside one of them is no other place.
  found.clusters[0].weight = 0.41;
  found.clusters.push_back(at(0.2, {1.28, 3.4, 0.5}));
  EXPECT_EQ(sentence_of(found),
            "2 places fit: 61 % at (1.20, 3.40) m, 0.50 rad; 39 % at (-5.00, 2.00) m, -1.00 rad");
}

}  // namespace
}  // namespace pf_resampling
