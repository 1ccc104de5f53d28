#include "pf_resampling_core/smoothing/smoother.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "pf_resampling_core/test/smoothing/ring_drive.hpp"

namespace pf_resampling {
namespace {

SensorConstants no_constants() {
  return SensorConstants::Zero();
}

SensorConstants loose() {
  SensorConstants sigma;
  sigma << 0.05, 0.1, 0.0, 0.001, 0.0, 0.03, 0.03;
  return sigma;
}

// Consistent: over 60 drives the errors of landmarks, newest pose and constants, squared by the
// stated covariance, have a mean of their number, within 4.4 of its standard errors (a false alarm
// in 1e5 runs).
TEST(Smoother, ErrorsAreAsStated) {
  double sum = 0.0;
  double freedom = 0.0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const RandomStream random(seed, RandomPurpose::test, 1);
    SensorConstants errors = SensorConstants::Zero();
    // So small that dead reckoning stays near enough for the linearisation to hold.
    const SensorConstants sigma = 0.3 * loose();
    for (int k = 0; k < kSensorConstants; ++k) {
      errors[k] = sigma[k] * random.normal(static_cast<std::uint64_t>(k));
    }
    RingDrive drive(260, 16, seed, sigma, errors);
    ASSERT_TRUE(smooth(0.0, &drive.graph)) << seed;
    const Eigen::Index landmarks = 2 * static_cast<Eigen::Index>(drive.graph.landmarks.size());
    Eigen::VectorXd error(landmarks + 3);
    for (std::size_t l = 0; l < drive.graph.landmarks.size(); ++l) {
      error.segment<2>(2 * static_cast<Eigen::Index>(l)) =
          drive.graph.landmarks[l] -
          drive.truth.landmarks[static_cast<std::size_t>(drive.order[l])];
    }
    const Pose2& pose = drive.graph.poses.back();
    const Pose2& truth = drive.truth.poses.back();
    error.tail<3>() << pose.x - truth.x, pose.y - truth.y, wrap_angle(pose.heading - truth.heading);
    const Eigen::MatrixXd all = joint_covariance(drive.graph, 0.0);
    Eigen::MatrixXd covariance(landmarks + 3, landmarks + 3);
    covariance << all.topLeftCorner(landmarks, landmarks), all.topRightCorner(landmarks, 3),
        all.bottomLeftCorner(3, landmarks), all.bottomRightCorner(3, 3);
    sum += error.dot(covariance.ldlt().solve(error));
    freedom += static_cast<double>(error.size());
  }
  EXPECT_NEAR(sum / freedom, 1.0, 4.4 * std::sqrt(2.0 / freedom) + 0.02) << "0.02: linearisation";
}

TEST(Smoother, FindsTheSensorsConstants) {
  SensorConstants errors = SensorConstants::Zero();
  errors[SensorConstant::turn_scale] = 0.04;
  errors[SensorConstant::range_scale] = 0.03;
  errors[SensorConstant::bearing_bias] = -0.02;
  SensorConstants sigma = loose();
  sigma[SensorConstant::distance_scale] = 0.002;  // or no data could tell the map's scale
  RingDrive drive(600, 20, 5, sigma, errors);
  ASSERT_TRUE(smooth(0.0, &drive.graph));
  const Eigen::Index at = 2 * static_cast<Eigen::Index>(drive.graph.landmarks.size());
  const Eigen::MatrixXd covariance = joint_covariance(drive.graph, 0.0);
  for (const int k :
       {SensorConstant::turn_scale, SensorConstant::range_scale, SensorConstant::bearing_bias}) {
    const double stated = std::sqrt(covariance(at + k, at + k));
    EXPECT_LT(stated, 0.5 * loose()[k]) << k << ": learns nothing";
    // Four standard deviations: a false alarm in 16,000 draws; the seed is fixed.
    EXPECT_NEAR(drive.graph.constants[k], errors[k], 4.0 * stated) << k;
  }
}

// One sighting in twenty is of another landmark than it says: a robust solution is hardly farther
// from the one without these sightings than their loss explains, least squares is far from it.
TEST(Smoother, RobustLossWithstandsMisreadIds) {
  RingDrive drive(240, 20, 3, no_constants());
  ASSERT_TRUE(smooth(0.0, &drive.graph));
  SmoothingGraph without = drive.graph;
  SmoothingGraph robust = drive.graph;
  without.sightings.clear();
  for (std::size_t i = 0; i < robust.sightings.size(); ++i) {
    SightingFactor& sighting = robust.sightings[i];
    if (i % 20 == 0) {
      sighting.landmark = (sighting.landmark + 7) % static_cast<int>(robust.landmarks.size());
    } else {
      without.sightings.push_back(sighting);
    }
  }
  SmoothingGraph least_squares = robust;
  ASSERT_TRUE(smooth(2.0, &without));
  ASSERT_TRUE(smooth(2.0, &robust));
  ASSERT_TRUE(smooth(0.0, &least_squares));
  double near = 0.0;
  double far = 0.0;
  for (std::size_t l = 0; l < robust.landmarks.size(); ++l) {
    near = std::max(near, (robust.landmarks[l] - without.landmarks[l]).norm());
    far = std::max(far, (least_squares.landmarks[l] - without.landmarks[l]).norm());
  }
  EXPECT_LT(near, 0.05);
  EXPECT_GT(far, 0.5);
}

TEST(Smoother, RefusesWhatCannotBeSolved) {
  RingDrive drive(60, 8, 1, no_constants());
  SmoothingGraph graph = drive.graph;
  graph.prior.information(0, 0) = std::numeric_limits<double>::quiet_NaN();
  const double x = graph.poses[30].x;
  EXPECT_FALSE(smooth(0.0, &graph));
  EXPECT_EQ(graph.poses[30].x, x) << "a graph without a solution stays as it was";

  graph = drive.graph;
  graph.prior.information(0, 0) = -1e12;
  EXPECT_FALSE(smooth(0.0, &graph));
  EXPECT_EQ(graph.poses[30].x, x);
}

// Graphs that make solvers fail: each ends with a solution that is finite, or with a fault.
TEST(Smoother, HardGraphsEndInASolutionOrAFault) {
  std::vector<SmoothingGraph> graphs;
  RingDrive drive(60, 8, 1, loose());
  graphs.push_back(drive.graph);  // ranges of nearly zero
  for (std::size_t i = 0; i < drive.graph.sightings.size(); i += 7) {
    graphs.back().sightings[i].range = 1e-9;
  }
  graphs.push_back(drive.graph);  // a landmark seen once, and one never
  const int landmarks = static_cast<int>(graphs.back().landmarks.size());
  graphs.back().landmarks.emplace_back(5.0, 5.0);
  graphs.back().landmarks.emplace_back(7.0, 5.0);
  graphs.back().sightings.push_back({40, landmarks, 3.0, 0.1, 0.01, 4e-4, {}});
  graphs.push_back(drive.graph);  // a second component: no sighting of the second half
  auto& sightings = graphs.back().sightings;
  sightings.resize(sightings.size() / 4);
  graphs.push_back(drive.graph);  // doubled nodes: no motion, no noise
  for (std::size_t i = 0; i < 59; i += 3) graphs.back().motions[i] = MotionFactor();
  graphs.push_back(drive.graph);  // far from the origin
  graphs.back().prior.pose = {1e6, -1e6, 1.0};
  graphs.back().poses.front() = graphs.back().prior.pose;
  graphs.push_back(drive.graph);  // a loop closed wrongly
  graphs.back().sightings.back().landmark = 0;
  graphs.back().sightings.back().range = 40.0;
  for (std::size_t g = 0; g < graphs.size(); ++g) {
    SmoothingGraph& graph = graphs[g];
    smooth(2.0, &graph);
    for (const Pose2& pose : graph.poses) {
      ASSERT_TRUE(std::isfinite(pose.x + pose.y + pose.heading)) << g;
    }
  }
}

}  // namespace
}  // namespace pf_resampling
