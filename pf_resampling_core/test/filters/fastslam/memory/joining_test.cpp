#include "pf_resampling_core/filters/fastslam/memory/joining.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "pf_resampling_core/filters/fastslam/memory/segment_solver.hpp"
#include "pf_resampling_core/test/filters/fastslam/memory/segmented_drive.hpp"
#include "pf_resampling_core/test/smoothing/ring_drive.hpp"

namespace pf_resampling {
namespace {

constexpr double kWidth = 4.0;

std::size_t updates_of(const SegmentGraph& graph) {
  std::size_t updates = 0;
  for (const auto& segment : graph.segments) updates += segment->updates();
  return updates;
}

struct Solved {
  SegmentGraph graph;
  Eigen::MatrixXd covariance;  // of all landmarks
};

Solved solved(SegmentGraph graph) {
  std::unique_ptr<SegmentEquations> equations;
  EXPECT_TRUE(solve(kWidth, &graph, &equations).is_solved);
  std::vector<int> landmarks;
  for (std::size_t l = 0; l < graph.landmarks.size(); ++l) {
    landmarks.push_back(static_cast<int>(l));
  }
  return {graph, equations->covariance_of(landmarks)};
}

// The solution moves by less than `share` of the largest standard deviation; so do standard
// deviations.
void expect_same(const SegmentGraph& one, const SegmentGraph& other, double share) {
  const Solved expected = solved(one);
  const Solved found = solved(other);
  const double near = share * std::sqrt(expected.covariance.diagonal().maxCoeff());
  for (std::size_t l = 0; l < expected.graph.landmarks.size(); ++l) {
    EXPECT_LT((found.graph.landmarks[l] - expected.graph.landmarks[l]).norm(), near) << l;
  }
  const Pose2 moved = relative(expected.graph.newest(), found.graph.newest());
  EXPECT_LT(std::hypot(moved.x, moved.y), near);
  EXPECT_LT((found.covariance - expected.covariance).norm(), share * expected.covariance.norm());
}

TEST(Joining, LosesNothingWhereItKeepsTheData) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const SmoothingGraph drive = RingDrive(400, 15, seed, SensorConstants::Zero()).graph;
    const Memory memory = remembered(drive, kWidth);
    SegmentGraph joined = memory.graph();
    const std::size_t segments = joined.segments.size();
    ASSERT_TRUE(join_segments(1, 4, kWidth, &joined));
    ASSERT_EQ(joined.segments.size(), segments - 3);
    EXPECT_TRUE(joined.segments[1]->has_data());
    expect_same(memory.graph(), joined, 0.1);
  }
}

TEST(Joining, WithoutDataSaysTheSameOfAllThatIsLeft) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const SmoothingGraph drive = RingDrive(400, 15, seed, SensorConstants::Zero()).graph;
    SegmentGraph whole = remembered(drive, kWidth).graph();
    SegmentGraph joined = whole;
    ASSERT_TRUE(join_without_data(4, &joined));
    ASSERT_TRUE(join_without_data(4, &joined)) << "with a third";
    ASSERT_FALSE(joined.segments[4]->has_data());
    EXPECT_EQ(updates_of(joined), updates_of(whole));
    // Both have to go somewhere else: the last segment's odometry counts for a tenth.
    whole.motion_shares.back() = joined.motion_shares.back() = 0.1;
    expect_same(whole, joined, 0.1);
  }
}

TEST(Joining, PosesWithoutDataFollowTheEnd) {
  const SmoothingGraph drive = RingDrive(100, 15, 1, SensorConstants::Zero()).graph;
  SegmentGraph graph = remembered(drive, kWidth).graph();
  ASSERT_TRUE(join_without_data(0, &graph));
  const std::vector<Pose2> before = poses_of(graph, 0);
  graph.bases[1].x += 0.1;
  const std::vector<Pose2> after = poses_of(graph, 0);
  ASSERT_EQ(after.size(), 50u);
  const Eigen::Vector2d moved(after[24].x - before[24].x, after[24].y - before[24].y);
  EXPECT_NEAR(moved.norm(), 0.05, 1e-9);
}

// A ring: what was seen in the first lap is seen again in the second.
TEST(Joining, AnchorsAreSeenAgain) {
  const SmoothingGraph drive = RingDrive(400, 15, 1, SensorConstants::Zero()).graph;
  const SegmentGraph graph = remembered(drive, kWidth).graph();
  std::vector<double> begins;
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    begins.push_back(50.0 * static_cast<double>(s));
  }
  const std::vector<bool> anchored = anchored_segments(graph, begins);
  EXPECT_TRUE(anchored[0]);
  EXPECT_FALSE(anchored.back()) << "what comes next may tell of a slip";
  for (double& begin : begins) begin *= 0.001;
  for (const bool is_anchored : anchored_segments(graph, begins)) EXPECT_FALSE(is_anchored);
}

}  // namespace
}  // namespace pf_resampling
