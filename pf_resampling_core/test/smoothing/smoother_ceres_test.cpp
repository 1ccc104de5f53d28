// smooth() against Ceres, which takes its derivatives itself and factorises in its own order.
#include <gtest/gtest.h>

#include "pf_resampling_core/smoothing/smoother.hpp"
#include "pf_resampling_core/test/smoothing/ceres_smoother.hpp"
#include "pf_resampling_core/test/smoothing/ring_drive.hpp"

namespace pf_resampling {
namespace {

void compare(int poses, int landmarks, std::uint64_t seed, const SensorConstants& sigma) {
  RingDrive drive(poses, landmarks, seed, sigma);
  SmoothingGraph graph = drive.graph;
  ASSERT_EQ(smooth({50, 0.0}, &graph).fault, SmoothingFault::none);
  CeresSmoother ceres(drive.graph);
  ASSERT_TRUE(ceres.solve());
  double largest = 0.0;
  for (std::size_t i = 0; i < graph.poses.size(); ++i) {
    largest = std::max(largest, std::hypot(graph.poses[i].x - ceres.poses_[i][0],
                                           graph.poses[i].y - ceres.poses_[i][1]));
  }
  for (std::size_t l = 0; l < graph.landmarks.size(); ++l) {
    largest = std::max(largest, std::hypot(graph.landmarks[l].x() - ceres.landmarks_[l][0],
                                           graph.landmarks[l].y() - ceres.landmarks_[l][1]));
  }
  // Both stop where the cost no longer falls: a hundredth of the smallest standard deviation.
  EXPECT_LT(largest, 5e-4);

  const Eigen::MatrixXd expected = ceres.covariance();
  const Eigen::Index kept = 2 * static_cast<Eigen::Index>(graph.landmarks.size());
  ASSERT_EQ(expected.rows(), kept + 3);
  const Eigen::MatrixXd joint = joint_covariance(graph, 0.0);
  EXPECT_TRUE(joint.topLeftCorner(kept, kept).isApprox(expected.topLeftCorner(kept, kept), 1e-3));
  EXPECT_TRUE(joint.bottomRightCorner(3, 3).isApprox(expected.bottomRightCorner(3, 3), 1e-3));
}

TEST(SmootherCeres, SameSolutionWithKnownSensors) {
  compare(250, 12, 1, SensorConstants::Zero());
  compare(450, 40, 2, SensorConstants::Zero());
}

TEST(SmootherCeres, SameSolutionWithUnknownSensors) {
  SensorConstants sigma;
  sigma << 0.02, 0.02, 0.0, 0.0005, 0.0, 0.01, 0.01;
  compare(250, 12, 3, sigma);
}

}  // namespace
}  // namespace pf_resampling
