#include "pf_resampling_core/filters/fastslam/memory/local_graph.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pf_resampling_core/filters/fastslam/memory/segment_solver.hpp"
#include "pf_resampling_core/test/filters/fastslam/memory/segmented_drive.hpp"
#include "pf_resampling_core/test/smoothing/ring_drive.hpp"

namespace pf_resampling {
namespace {

// The newest segments with a Gaussian in front of them have the solution of the whole drive, and
// its covariances; and what speaks for an account there speaks for it here.
TEST(LocalGraph, SaysOfTheNewestWhatTheWholeDriveSays) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const SmoothingGraph drive = RingDrive(400, 15, seed, SensorConstants::Zero()).graph;
    Memory memory = remembered(drive, 4.0);
    SegmentGraph whole = memory.graph();
    // Not at the solution, so that what came before pulls.
    for (Eigen::Vector2d& landmark : whole.landmarks) landmark.x() += 0.2;
    const std::size_t from = whole.segments.size() - 3;
    std::optional<LocalGraph> local = local_graph(whole, from);
    ASSERT_TRUE(local.has_value());
    SegmentGraph& part = local->graph;
    ASSERT_EQ(part.segments.size(), 4u);
    // Both have to go somewhere else: the last segment's odometry counts for a tenth.
    whole.motion_shares.back() = part.motion_shares.back() = 0.1;
    std::unique_ptr<SegmentEquations> of_whole, of_part;
    const SegmentSolution all = solve(4.0, &whole, &of_whole);
    const SegmentSolution newest = solve(4.0, &part, &of_part);
    ASSERT_TRUE(all.is_solved);
    ASSERT_TRUE(newest.is_solved);
    const Eigen::MatrixXd expected = of_whole->covariance_of(local->landmarks);
    // Either stops a seventh of a standard deviation from its end.
    const double near = 0.3 * std::sqrt(expected.diagonal().maxCoeff());
    EXPECT_LT(std::hypot(whole.newest().x - part.newest().x, whole.newest().y - part.newest().y),
              near);
    std::vector<int> numbers;
    for (std::size_t i = 0; i < local->landmarks.size(); ++i) {
      const Eigen::Vector2d& there = whole.landmarks[static_cast<std::size_t>(local->landmarks[i])];
      EXPECT_LT((part.landmarks[i] - there).norm(), near);
      numbers.push_back(static_cast<int>(i));
    }
    EXPECT_LT((of_part->covariance_of(numbers) - expected).norm(), 0.02 * expected.norm());
  }
}

}  // namespace
}  // namespace pf_resampling
