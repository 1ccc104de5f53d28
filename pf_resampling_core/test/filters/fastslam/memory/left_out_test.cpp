#include "pf_resampling_core/filters/fastslam/memory/left_out.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "pf_resampling_core/filters/fastslam/memory/memory.hpp"
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
                              const std::vector<int>& group) {
  graph.noise = noise;
  const Eigen::MatrixXd by_data =
      derivative(graph, [&](const SmoothingGraph& g) { return residuals(g, group); });
  const Eigen::MatrixXd by_group = derivative(
      graph, [&](const SmoothingGraph& g) { return Eigen::VectorXd(group_mean(g, group)); });
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

// A drive, update by update; after each `updates` of them it is solved, and the noise is learnt.
Memory remember(const SmoothingGraph& drive, const SensorConstants& sigma, double robust_width,
                std::size_t updates, bool learns) {
  Memory memory;
  memory.start(drive.poses.front(), sigma);
  std::size_t next = 0;
  for (std::size_t i = 0; i < drive.motions.size(); ++i) {
    memory.append(drive.motions[i]);
    for (; next < drive.sightings.size() && drive.sightings[next].pose == static_cast<int>(i) + 1;
         ++next) {
      memory.append_sighting(drive.sightings[next].landmark, drive.sightings[next]);
    }
    if ((i + 1) % updates != 0 && i + 1 != drive.motions.size()) continue;
    EXPECT_TRUE(memory.solve(robust_width)) << i;
    if (learns) memory.validate(robust_width);
  }
  return memory;
}

// Where a sighting of the whole drive is in the segments.
SightingPlace place_of(const SegmentGraph& graph, std::size_t sighting) {
  SightingPlace place;
  while (sighting >= graph.segments[place.segment]->sightings.size()) {
    sighting -= graph.segments[place.segment++]->sightings.size();
  }
  place.sighting = sighting;
  return place;
}

// All sightings of a landmark from one of its passages.
std::vector<int> some_passage(const SmoothingGraph& graph) {
  std::vector<int> group;
  for (int s = 0; s < static_cast<int>(graph.sightings.size()); ++s) {
    const SightingFactor& sighting = graph.sightings[static_cast<std::size_t>(s)];
    if (sighting.landmark == 2 && sighting.pose > 70) group.push_back(s);
  }
  return group;
}

LeftOutSightings block_of(const SegmentGraph& graph, const std::vector<int>& group) {
  LeftOutSightings block;
  for (const int s : group) block.sightings.push_back(place_of(graph, static_cast<std::size_t>(s)));
  block.groups = {block.sightings};
  return block;
}

TEST(LeftOut, IsPredictedAsByADenseSolutionWithoutIt) {
  SmoothingGraph graph = RingDrive(100, 6, 3, loose()).graph;
  const NoiseScales noise = {1.5, 1.2, 2.0};
  Memory memory = remember(graph, loose(), 0.0, 25, false);
  MemoryState state = memory.state();
  state.graph.noise = graph.noise = noise;
  memory.resume(state);
  ASSERT_TRUE(memory.solve(0.0));
  graph.motions.clear();  // those of the memory know what they say of scale and delay
  for (const auto& segment : memory.graph().segments) {
    graph.motions.insert(graph.motions.end(), segment->motions.begin(), segment->motions.end());
  }
  ASSERT_TRUE(smooth(0.0, &graph));
  const std::vector<int> group = some_passage(graph);
  ASSERT_GT(group.size(), 3u);
  const std::vector<PredictedBlock> blocks =
      predict(memory.graph(), 0.0, {block_of(memory.graph(), group)});
  ASSERT_EQ(blocks.size(), 1u);
  ASSERT_EQ(blocks[0].size(), 1u);
  const PredictionError& predicted = blocks[0][0];

  SmoothingGraph without = graph;
  without.sightings.clear();
  for (int s = 0; s < static_cast<int>(graph.sightings.size()); ++s) {
    if (std::find(group.begin(), group.end(), s) == group.end()) {
      without.sightings.push_back(graph.sightings[static_cast<std::size_t>(s)]);
    }
  }
  ASSERT_TRUE(smooth(0.0, &without));
  without.sightings = graph.sightings;
  const Eigen::Vector2d error = group_mean(without, group);
  // One step of Gauss and Newton from the solution with the block.
  EXPECT_NEAR(predicted.error[0] / (1.5 * error[0]), 1.0, 0.03);
  EXPECT_NEAR(predicted.error[1] / (1.2 * error[1]), 1.0, 0.03);

  EXPECT_TRUE(sum_of(predicted, noise).isApprox(covariance_of(graph, noise, group), 3e-3));
  // To first order in each scale.
  for (const NoiseScales& other :
       {NoiseScales{1.51, 1.2, 2.0}, NoiseScales{1.5, 1.21, 2.0}, NoiseScales{1.5, 1.2, 2.01}}) {
    const Eigen::Matrix2d change =
        covariance_of(graph, other, group) - covariance_of(graph, noise, group);
    const Eigen::Matrix2d expected = sum_of(predicted, other) - sum_of(predicted, noise);
    EXPECT_LT((change - expected).norm(), 0.03 * expected.norm() + 1e-6);
  }
}

TEST(LeftOut, SaysNothingWhereNothingElseDoes) {
  const SmoothingGraph graph = RingDrive(100, 6, 3, loose()).graph;
  const Memory memory = remember(graph, loose(), 0.0, 25, false);
  std::vector<int> all;
  for (int s = 0; s < static_cast<int>(graph.sightings.size()); ++s) {
    if (graph.sightings[static_cast<std::size_t>(s)].landmark == 2) all.push_back(s);
  }
  EXPECT_TRUE(predict(memory.graph(), 0.0, {block_of(memory.graph(), all)}).empty());
}

// What is stated is four times as large as it is. Between two sightings the odometry adds 28 mm to
// 70 mm of the ranges, and 16 mrad to 28 mrad of the bearings. Medians of 300 pairs: within 13 %,
// two standard errors.
TEST(LeftOut, SightingsThatScatterLessThanStatedAreFound) {
  SmoothingGraph graph = RingDrive(200, 12, 3, loose()).graph;
  for (MotionFactor& motion : graph.motions) motion.sensitivity(2, SensorConstant::yaw_rate) = 0.25;
  const NoiseScales as_stated = scatter(remember(graph, loose(), 0.0, 25, false).graph());
  EXPECT_GT(as_stated.range, 0.9);
  EXPECT_GT(as_stated.bearing, 0.9);
  for (SightingFactor& sighting : graph.sightings) {
    sighting.range_variance *= 16.0;
    sighting.bearing_variance *= 16.0;
  }
  // The poses of the solution follow the bearings, those of the odometry do not.
  const NoiseScales found = scatter(remember(graph, loose(), 0.0, 25, false).graph());
  EXPECT_NEAR(found.range, 0.25 * std::hypot(0.05, 0.02) / 0.05, 0.036);
  EXPECT_NEAR(found.bearing, 0.25 * std::hypot(0.02, 0.0115) / 0.02, 0.037);
  EXPECT_EQ(found.motion, 1.0);
}

// One segment with sightings of landmarks 0 and 1, at updates that end at these times.
SegmentGraph sightings_at(const std::vector<std::pair<int, int>>& update_and_landmark,
                          const std::vector<double>& times) {
  auto segment = std::make_shared<Segment>();
  double before = 0.0;
  for (const double time : times) {
    MotionFactor motion;
    motion.sensitivity(2, SensorConstant::yaw_rate) = time - before;
    before = time;
    segment->motions.push_back(motion);
  }
  for (const auto& [update, landmark] : update_and_landmark) {
    SightingFactor sighting;
    sighting.pose = update;
    add_sighting(landmark, sighting, segment.get());
  }
  SegmentGraph graph;
  graph.landmarks.resize(2);
  graph.segments = {segment};
  return graph;
}

std::vector<double> seconds(int count) {
  std::vector<double> times;
  for (int i = 0; i < count; ++i) times.push_back(i);
  return times;
}

using Sightings = std::vector<std::size_t>;
Sightings numbers(const std::vector<SightingPlace>& places) {
  Sightings numbers;
  for (const SightingPlace& place : places) numbers.push_back(place.sighting);
  return numbers;
}

TEST(LeftOut, APassageEndsWithAGapOrAfterHalfAMinute) {
  // Landmark 0 at 1, 2 and 14 s; landmark 1 at 3 s and from 20 to 55 s.
  std::vector<std::pair<int, int>> seen = {{1, 0}, {2, 0}, {3, 1}, {14, 0}};
  for (int t = 20; t <= 55; ++t) seen.emplace_back(t, 1);
  const SegmentGraph graph = sightings_at(seen, seconds(100));
  const std::vector<LeftOutSightings> first = completed_passages(graph, {0.0}, 0.0, 40.0);
  ASSERT_EQ(first.size(), 3u);  // they end at 12, 13 and 24 s
  EXPECT_EQ(numbers(first[0].sightings), (Sightings{0, 1}));
  EXPECT_EQ(numbers(first[1].sightings), (Sightings{2}));
  EXPECT_EQ(numbers(first[2].sightings), (Sightings{3}));
  ASSERT_EQ(first[0].groups.size(), 1u);
  EXPECT_EQ(numbers(first[0].groups[0]), (Sightings{0, 1}));
  const std::vector<LeftOutSightings> rest = completed_passages(graph, {0.0}, 40.0, 99.0);
  ASSERT_EQ(rest.size(), 2u);  // at 50 and 65 s
  EXPECT_EQ(rest[0].sightings.size(), 31u);
  EXPECT_EQ(rest[1].sightings.size(), 5u);
  EXPECT_TRUE(completed_passages(graph, {0.0}, 65.0, 99.0).empty());
}

TEST(LeftOut, WindowsTestTheirMiddle) {
  const SegmentGraph graph =
      sightings_at({{3, 0}, {7, 0}, {12, 1}, {18, 0}, {30, 0}}, seconds(100));
  const std::vector<LeftOutSightings> blocks = completed_windows(graph, {0.0}, 0.0, 40.0);
  // From 0 to 25 s, known at 37.5 s: sightings at 7, 12 and 18 s lie within 6.25 s of the middle.
  ASSERT_EQ(blocks.size(), 1u);
  EXPECT_EQ(numbers(blocks[0].sightings), (Sightings{0, 1, 2, 3}));
  ASSERT_EQ(blocks[0].groups.size(), 2u);
  EXPECT_EQ(numbers(blocks[0].groups[0]), (Sightings{1, 3}));
  EXPECT_EQ(numbers(blocks[0].groups[1]), (Sightings{2}));
  // From 12.5 to 37.5 s, known at 50 s. From 25 to 50 s nothing is seen in the middle.
  const std::vector<LeftOutSightings> later = completed_windows(graph, {0.0}, 40.0, 65.0);
  ASSERT_EQ(later.size(), 1u);
  EXPECT_EQ(numbers(later[0].sightings), (Sightings{3, 4}));
  ASSERT_EQ(later[0].groups.size(), 1u);
  EXPECT_EQ(numbers(later[0].groups[0]), (Sightings{4}));
}

// Clocks jump.
TEST(LeftOut, WindowsCanBeAgesApart) {
  const SegmentGraph graph = sightings_at({{0, 0}, {1, 0}}, {20.0, 1.8e9});
  const std::vector<LeftOutSightings> blocks = completed_windows(graph, {0.0}, 0.0, 2e9);
  ASSERT_EQ(blocks.size(), 2u);
  EXPECT_EQ(numbers(blocks[0].sightings), (Sightings{0}));
  EXPECT_EQ(numbers(blocks[1].sightings), (Sightings{1}));
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
  return remember(graph, SensorConstants::Zero(), 4.0, 25, true).graph().noise;
}

// White noise. The seeds are fixed, so this test raises no false alarm by chance.
TEST(LeftOut, WhiteNoiseIsHardlyEverFoundLarger) {
  double sum = 0.0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const NoiseScales scales = scales_of_a_drive(seed, 0.0);
    for (const double scale : {scales.range, scales.bearing, scales.motion}) {
      EXPECT_LE(scale, 1.2) << seed;
      sum += scale / 30.0;
    }
  }
  EXPECT_LT(sum, 1.05);
}

TEST(LeftOut, ErrorsThatLastAreFound) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const NoiseScales scales = scales_of_a_drive(seed, 10.0);
    EXPECT_GT(scales.range, 1.3) << seed;
    EXPECT_GT(scales.range, 1.2 * scales.bearing) << seed;
  }
}

}  // namespace
}  // namespace pf_resampling
