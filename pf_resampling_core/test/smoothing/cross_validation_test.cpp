#include "pf_resampling_core/smoothing/cross_validation.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>

#include "pf_resampling_core/smoothing/residuals.hpp"
#include "pf_resampling_core/smoothing/smoother.hpp"
#include "pf_resampling_core/test/smoothing/ring_drive.hpp"

namespace pf_resampling {
namespace {

constexpr double kStep = 1e-6;

// All unknowns of a graph in one vector: poses, landmarks, constants.
SmoothingGraph moved(SmoothingGraph graph, const Eigen::VectorXd& by) {
  Eigen::Index at = 0;
  for (Pose2& pose : graph.poses) {
    pose = {pose.x + by[at], pose.y + by[at + 1], pose.heading + by[at + 2]};
    at += 3;
  }
  for (Eigen::Vector2d& landmark : graph.landmarks) {
    landmark += by.segment<2>(at);
    at += 2;
  }
  graph.constants += by.segment<kSensorConstants>(at);
  return graph;
}

Eigen::Index unknowns(const SmoothingGraph& graph) {
  return 3 * static_cast<Eigen::Index>(graph.poses.size()) +
         2 * static_cast<Eigen::Index>(graph.landmarks.size()) + kSensorConstants;
}

Eigen::Vector2d residual(const SmoothingGraph& graph, int sighting) {
  const SightingFactor& z = graph.sightings[static_cast<std::size_t>(sighting)];
  return sighting_residual(z, graph.noise, graph.poses[static_cast<std::size_t>(z.pose)],
                           graph.landmarks[static_cast<std::size_t>(z.landmark)], graph.constants)
      .value;
}

// Everything but `left_out` that the graph says, in standard deviations.
Eigen::VectorXd residuals(const SmoothingGraph& graph, const std::vector<int>& left_out) {
  std::vector<double> all;
  for (std::size_t i = 0; i < graph.motions.size(); ++i) {
    const Eigen::Vector3d r =
        motion_residual(graph.motions[i], motion_root(graph.motions[i], graph.noise.motion),
                        graph.poses[i], graph.poses[i + 1], graph.constants)
            .value;
    all.insert(all.end(), r.data(), r.data() + 3);
  }
  for (int s = 0; s < static_cast<int>(graph.sightings.size()); ++s) {
    if (std::find(left_out.begin(), left_out.end(), s) != left_out.end()) continue;
    const Eigen::Vector2d r = residual(graph, s);
    all.insert(all.end(), r.data(), r.data() + 2);
  }
  const Pose2& first = graph.poses.front();
  for (const double known : {first.x, first.y, first.heading}) all.push_back(1e6 * known);
  for (int k = 0; k < kSensorConstants; ++k) {
    all.push_back(std::sqrt(graph.prior.information(3 + k, 3 + k)) * graph.constants[k]);
  }
  return Eigen::Map<const Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size()));
}

// The mean residual of a group, all of which state the same noise, in standard deviations of it.
Eigen::Vector2d group_mean(const SmoothingGraph& graph, const std::vector<int>& group) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const int s : group) sum += residual(graph, s);
  return sum / std::sqrt(static_cast<double>(group.size()));
}

template <typename Function>
Eigen::MatrixXd derivative(const SmoothingGraph& graph, const Function& function) {
  const Eigen::Index size = unknowns(graph);
  Eigen::MatrixXd jacobian;
  for (Eigen::Index i = 0; i < size; ++i) {
    Eigen::VectorXd step = Eigen::VectorXd::Zero(size);
    step[i] = kStep;
    const Eigen::VectorXd slope =
        (function(moved(graph, step)) - function(moved(graph, -step))) / (2.0 * kStep);
    if (i == 0) jacobian.resize(slope.size(), size);
    jacobian.col(i) = slope;
  }
  return jacobian;
}

// The prediction's covariance, dense, by numeric derivatives; in standard deviations as stated.
Eigen::Matrix2d covariance_of(SmoothingGraph graph, const NoiseScales& noise,
                              const LeftOutBlock& block) {
  graph.noise = noise;
  const Eigen::MatrixXd by_data =
      derivative(graph, [&](const SmoothingGraph& g) { return residuals(g, block.sightings); });
  const Eigen::MatrixXd by_group = derivative(graph, [&](const SmoothingGraph& g) {
    return Eigen::VectorXd(group_mean(g, block.groups[0]));
  });
  const Eigen::MatrixXd information = by_data.transpose() * by_data;
  const Eigen::Vector2d unit(noise.range, noise.bearing);
  return unit.asDiagonal() *
         (Eigen::Matrix2d::Identity() + by_group * information.ldlt().solve(by_group.transpose()))
             .eval() *
         unit.asDiagonal();
}

Eigen::Matrix2d sum_of(const PredictionError& e, const NoiseScales& noise) {
  return noise.range * noise.range * e.by_ranges + noise.bearing * noise.bearing * e.by_bearings +
         noise.motion * noise.motion * e.by_motions + e.by_prior;
}

SensorConstants loose() {
  SensorConstants sigma;
  sigma << 0.05, 0.1, 0.0, 0.001, 0.0, 0.03, 0.03;
  return sigma;
}

// All sightings of a landmark from one of its passages.
LeftOutBlock some_block(const SmoothingGraph& graph) {
  std::vector<int> group;
  for (int s = 0; s < static_cast<int>(graph.sightings.size()); ++s) {
    const SightingFactor& sighting = graph.sightings[static_cast<std::size_t>(s)];
    if (sighting.landmark == 2 && sighting.pose > 70) group.push_back(s);
  }
  return {group, {group}};
}

TEST(CrossValidation, PredictsAsADenseSolutionWithoutTheBlock) {
  RingDrive drive(100, 6, 3, loose());
  SmoothingGraph graph = drive.graph;
  graph.noise = {1.5, 1.2, 2.0};
  ASSERT_EQ(smooth({20, 0.0}, &graph).fault, SmoothingFault::none);
  const LeftOutBlock block = some_block(graph);
  ASSERT_GT(block.sightings.size(), 3u);
  const std::vector<PredictedBlock> blocks = cross_validate(graph, 0.0, {block});
  ASSERT_EQ(blocks.size(), 1u);
  ASSERT_EQ(blocks[0].size(), 1u);
  const PredictionError& predicted = blocks[0][0];

  SmoothingGraph without = graph;
  without.sightings.clear();
  for (int s = 0; s < static_cast<int>(graph.sightings.size()); ++s) {
    if (std::find(block.sightings.begin(), block.sightings.end(), s) == block.sightings.end()) {
      without.sightings.push_back(graph.sightings[static_cast<std::size_t>(s)]);
    }
  }
  ASSERT_EQ(smooth({20, 0.0}, &without).fault, SmoothingFault::none);
  without.sightings = graph.sightings;
  const Eigen::Vector2d error = group_mean(without, block.groups[0]);
  // One step of Gauss and Newton from the solution with the block.
  EXPECT_NEAR(predicted.error[0] / (1.5 * error[0]), 1.0, 0.03);
  EXPECT_NEAR(predicted.error[1] / (1.2 * error[1]), 1.0, 0.03);

  EXPECT_TRUE(
      sum_of(predicted, graph.noise).isApprox(covariance_of(graph, graph.noise, block), 1e-3));
  // To first order in each scale.
  for (const NoiseScales& other :
       {NoiseScales{1.51, 1.2, 2.0}, NoiseScales{1.5, 1.21, 2.0}, NoiseScales{1.5, 1.2, 2.01}}) {
    const Eigen::Matrix2d change =
        covariance_of(graph, other, block) - covariance_of(graph, graph.noise, block);
    const Eigen::Matrix2d expected = sum_of(predicted, other) - sum_of(predicted, graph.noise);
    EXPECT_LT((change - expected).norm(), 0.03 * expected.norm() + 1e-6);
  }
}

TEST(CrossValidation, LeavesOutWhatNothingElseSays) {
  RingDrive drive(100, 6, 3, loose());
  SmoothingGraph graph = drive.graph;
  ASSERT_EQ(smooth({20, 0.0}, &graph).fault, SmoothingFault::none);
  std::vector<int> all;
  for (int s = 0; s < static_cast<int>(graph.sightings.size()); ++s) {
    if (graph.sightings[static_cast<std::size_t>(s)].landmark == 2) all.push_back(s);
  }
  EXPECT_TRUE(cross_validate(graph, 0.0, {{all, {all}}}).empty());
}

// Sightings of landmarks 0 and 1 from poses a second apart.
SmoothingGraph sightings_at(const std::vector<std::pair<int, int>>& pose_and_landmark, int poses) {
  SmoothingGraph graph;
  graph.poses.resize(static_cast<std::size_t>(poses));
  graph.landmarks.resize(2);
  for (const auto& [pose, landmark] : pose_and_landmark) {
    SightingFactor sighting;
    sighting.pose = pose;
    sighting.landmark = landmark;
    graph.sightings.push_back(sighting);
  }
  return graph;
}

std::vector<double> seconds(int count) {
  std::vector<double> times;
  for (int i = 0; i < count; ++i) times.push_back(i);
  return times;
}

using Sightings = std::vector<int>;

TEST(CrossValidation, APassageEndsWithAGapOrAfterHalfAMinute) {
  // Landmark 0 at 1, 2 and 14 s; landmark 1 at 3 s and from 20 to 55 s.
  std::vector<std::pair<int, int>> seen = {{1, 0}, {2, 0}, {3, 1}, {14, 0}};
  for (int t = 20; t <= 55; ++t) seen.emplace_back(t, 1);
  const SmoothingGraph graph = sightings_at(seen, 100);
  const std::vector<LeftOutBlock> first = passages(graph, seconds(100), 0.0, 40.0);
  ASSERT_EQ(first.size(), 3u);  // they end at 12, 13 and 24 s
  EXPECT_EQ(first[0].sightings, (Sightings{0, 1}));
  EXPECT_EQ(first[1].sightings, (Sightings{2}));
  EXPECT_EQ(first[2].sightings, (Sightings{3}));
  EXPECT_EQ(first[0].groups, (std::vector<Sightings>{{0, 1}}));
  const std::vector<LeftOutBlock> rest = passages(graph, seconds(100), 40.0, 99.0);
  ASSERT_EQ(rest.size(), 2u);  // at 50 and 65 s
  EXPECT_EQ(rest[0].sightings.size(), 31u);
  EXPECT_EQ(rest[1].sightings.size(), 5u);
  EXPECT_TRUE(passages(graph, seconds(100), 65.0, 99.0).empty());
}

TEST(CrossValidation, WindowsTestTheirMiddle) {
  const SmoothingGraph graph = sightings_at({{3, 0}, {7, 0}, {12, 1}, {18, 0}, {30, 0}}, 100);
  const std::vector<LeftOutBlock> blocks = windows(graph, seconds(100), 0.0, 40.0);
  // From 0 to 25 s, known at 37.5 s: sightings at 7, 12 and 18 s lie within 6.25 s of the middle.
  ASSERT_EQ(blocks.size(), 1u);
  EXPECT_EQ(blocks[0].sightings, (Sightings{0, 1, 2, 3}));
  EXPECT_EQ(blocks[0].groups, (std::vector<Sightings>{{1, 3}, {2}}));
  // From 12.5 to 37.5 s, known at 50 s. From 25 to 50 s nothing is seen in the middle.
  const std::vector<LeftOutBlock> later = windows(graph, seconds(100), 40.0, 65.0);
  ASSERT_EQ(later.size(), 1u);
  EXPECT_EQ(later[0].sightings, (Sightings{3, 4}));
  EXPECT_EQ(later[0].groups, (std::vector<Sightings>{{4}}));
}

// Clocks jump, and files may say anything.
TEST(CrossValidation, WindowsCanBeAgesApart) {
  const SmoothingGraph graph = sightings_at({{0, 0}, {1, 0}, {2, 0}}, 3);
  const std::vector<LeftOutBlock> blocks = windows(graph, {-1e300, 0.0, 1.8e9}, -1e300, 2e9);
  ASSERT_EQ(blocks.size(), 2u);
  EXPECT_EQ(blocks[0].sightings, (Sightings{1}));
  EXPECT_EQ(blocks[1].sightings, (Sightings{2}));
}

// Errors of range and bearing with these standard deviations where 1 was stated.
std::vector<PredictedBlock> errors(int count, double range, double bearing, std::uint64_t seed) {
  const RandomStream random(seed, RandomPurpose::test, 0);
  std::vector<PredictedBlock> blocks;
  for (int i = 0; i < count; ++i) {
    PredictionError error;
    const std::uint64_t at = 2 * static_cast<std::uint64_t>(i);
    error.error = {range * random.normal(at), bearing * random.normal(at + 1)};
    error.by_ranges(0, 0) = 1.0;
    error.by_bearings(1, 1) = 1.0;
    blocks.push_back({error});
  }
  return blocks;
}

// 2000 blocks: a scale has a standard error of 1.1 to 1.6 %, and stays below by as much on purpose.
// The last, of range and bearing apart, keeps the product that a common scale would have.
TEST(CrossValidation, FindsTheScales) {
  const NoiseScales alike = noise_scales(errors(2000, 2.0, 2.0, 1), errors(2000, 2.0, 2.0, 2));
  EXPECT_NEAR(alike.range, 2.0, 0.15);
  EXPECT_NEAR(alike.bearing, 2.0, 0.15);
  EXPECT_EQ(alike.motion, 1.0);
  const NoiseScales apart = noise_scales(errors(2000, 3.0, 1.5, 3), errors(2000, 3.0, 1.5, 4));
  EXPECT_NEAR(apart.range / apart.bearing, 2.0, 0.15);
  EXPECT_GT(apart.range, 2.5);
  EXPECT_LT(apart.bearing, 2.0);
}

TEST(CrossValidation, FindsTheNoiseOfMotions) {
  std::vector<PredictedBlock> of_windows = errors(2000, 3.0, 3.0, 5);
  for (PredictedBlock& block : of_windows) block[0].by_motions = 2.0 * Eigen::Matrix2d::Identity();
  const NoiseScales scales = noise_scales(errors(2000, 1.0, 1.0, 6), of_windows);
  // 9 = 1 + 2·scale².
  EXPECT_NEAR(scales.motion, 2.0, 0.15);
}

TEST(CrossValidation, NothingIsLearntFromNothing) {
  const NoiseScales none = noise_scales({}, {});
  EXPECT_EQ(none.range, 1.0);
  EXPECT_EQ(none.bearing, 1.0);
  EXPECT_EQ(none.motion, 1.0);
  // Too small errors do not make the noise smaller than stated.
  const NoiseScales small = noise_scales(errors(500, 0.3, 0.3, 7), errors(500, 0.3, 0.3, 8));
  EXPECT_EQ(small.range, 1.0);
  EXPECT_EQ(small.bearing, 1.0);
}

TEST(CrossValidation, ErrorsWithoutACovarianceSayNothing) {
  std::vector<PredictedBlock> of_passages = errors(100, 2.0, 2.0, 1);
  const NoiseScales scales = noise_scales(of_passages, {});
  for (PredictedBlock& block : of_passages) block.push_back(PredictionError());
  EXPECT_EQ(noise_scales(of_passages, {}).range, scales.range);
}

TEST(CrossValidation, ErrorsWithoutMeasureLeaveFiniteScales) {
  std::vector<PredictedBlock> of_passages = errors(10, 1.0, 1.0, 1);
  for (PredictedBlock& block : of_passages) {
    block[0].error = {1e300, 1e300};
    block[0].by_motions << 0.0, 5.0, 5.0, 99.0;  // the square would be infinity less infinity
  }
  const NoiseScales scales = noise_scales(of_passages, of_passages);
  for (const double scale : {scales.range, scales.bearing, scales.motion}) {
    EXPECT_GE(scale, 1.0);
    EXPECT_LE(scale, kLargestNoiseScale);
  }
}

// A drive of 1000 s; errors of ranges last `memory` seconds, with the variance that is stated.
NoiseScales scales_of_a_drive(std::uint64_t seed, double memory) {
  RingDrive drive(1000, 15, seed, SensorConstants::Zero());
  SmoothingGraph graph = drive.graph;
  if (memory > 0.0) {
    const RandomStream random(seed, RandomPurpose::test, 1);
    double error = 0.0;
    int pose = 0;
    for (std::size_t s = 0; s < graph.sightings.size(); ++s) {
      SightingFactor& sighting = graph.sightings[s];
      const double left = std::exp((pose - sighting.pose) / memory);
      if (sighting.pose > pose) {
        error = left * error + 0.05 * std::sqrt(1.0 - left * left) * random.normal(s);
      }
      pose = sighting.pose;
      const std::size_t landmark =
          static_cast<std::size_t>(drive.order[static_cast<std::size_t>(sighting.landmark)]);
      const Pose2& at = drive.truth.poses[static_cast<std::size_t>(sighting.pose)];
      sighting.range =
          (drive.truth.landmarks[landmark] - Eigen::Vector2d(at.x, at.y)).norm() + error;
    }
  }
  EXPECT_EQ(smooth({30, 4.0}, &graph).fault, SmoothingFault::none);
  const std::vector<double> times = seconds(1000);
  return noise_scales(cross_validate(graph, 4.0, passages(graph, times, 0.0, 999.0)),
                      cross_validate(graph, 4.0, windows(graph, times, 0.0, 999.0)));
}

// What is asked for: no more than 1.15 where the noise is white. The seeds are fixed, so this test
// raises no false alarm by chance.
TEST(CrossValidation, WhiteNoiseIsHardlyEverFoundLarger) {
  double sum = 0.0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const NoiseScales scales = scales_of_a_drive(seed, 0.0);
    for (const double scale : {scales.range, scales.bearing, scales.motion}) {
      EXPECT_LE(scale, 1.15) << seed;
      sum += scale / 30.0;
    }
  }
  EXPECT_LT(sum, 1.05);
}

TEST(CrossValidation, ErrorsThatLastAreFound) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const NoiseScales scales = scales_of_a_drive(seed, 10.0);
    EXPECT_GT(scales.range, 1.3) << seed;
    EXPECT_GT(scales.range, 1.2 * scales.bearing) << seed;
  }
}

// Of n blocks of two numbers, a deviation has a standard error of 1/(2 sqrt(n)): three of them.
TEST(CrossValidation, NoiseIsDoubtedLessTheMoreWasPredicted) {
  EXPECT_EQ(noise_doubt(0), 6.0);
  EXPECT_NEAR(noise_doubt(1), std::exp(1.5), 1e-12);
  EXPECT_NEAR(noise_doubt(9), std::exp(0.5), 1e-12);
  EXPECT_LT(noise_doubt(10000), 1.02);
}

}  // namespace
}  // namespace pf_resampling
