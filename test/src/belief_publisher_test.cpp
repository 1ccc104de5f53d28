#include "src/pipeline/belief_publisher.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "src/messages/conversions.hpp"
#include "test/pipeline_outputs.hpp"

namespace pf_resampling {
namespace {

const double kNoNumber = std::numeric_limits<double>::quiet_NaN();
const double kInfinite = std::numeric_limits<double>::infinity();
const Pose2 kThere = {1.0, 2.0, 0.5};

PoseEstimate sure(const Pose2& mean) {
  return {mean, 0.01 * Eigen::Matrix3d::Identity()};
}

struct Publisher {
  explicit Publisher(const OutputOptions& options = {}) : belief(FrameNames(), options, &sinks) {
    connect(&out, &sinks);
    sinks.estimate = [this](ros::Time, const PoseEstimate&) { ++estimates; };
  }

  Outputs out;
  int estimates = 0;
  PipelineSinks sinks;
  BeliefPublisher belief;
};

TEST(BeliefPublisher, APoseThatIsNotFiniteIsHeldBackAndCounted) {
  OutputOptions options;
  options.path_period = 0.0;
  Publisher publisher(options);
  std::vector<PoseEstimate> bad(3, sure(kThere));
  bad[0].mean.x = kNoNumber;
  bad[1].mean.heading = kInfinite;
  bad[2].covariance(0, 1) = kNoNumber;
  for (const PoseEstimate& estimate : bad)
    publisher.belief.publish_pose(ros::Time(1.0), estimate, {});
  publisher.belief.publish_path(ros::Time(1.0));
  EXPECT_EQ(publisher.belief.held_back(), 3u);
  EXPECT_TRUE(publisher.out.poses.empty());
  EXPECT_TRUE(publisher.out.transforms.empty());
  EXPECT_TRUE(publisher.out.paths.empty());
  EXPECT_EQ(publisher.estimates, 0);
  publisher.belief.publish_pose(ros::Time(2.0), sure(kThere), {});
  publisher.belief.publish_path(ros::Time(2.0));
  EXPECT_EQ(publisher.belief.held_back(), 3u);
  EXPECT_EQ(publisher.out.poses.size(), 1u);
  EXPECT_EQ(publisher.out.transforms.size(), 1u);
  ASSERT_EQ(publisher.out.paths.size(), 1u);
  EXPECT_EQ(publisher.out.paths[0].poses.size(), 1u);
  EXPECT_EQ(publisher.estimates, 1);
}

// As of a map of two hours where simulated time begins anew.
TEST(BeliefPublisher, AFindingOfBeforeTimeBeganHasNoTime) {
  Finding finding;
  finding.begin = -7200.0;
  finding.end = 10.0;
  const std::vector<FindingStatus> messages = to_messages({finding}, 0.0);
  EXPECT_EQ(messages[0].begin, ros::Time());
  EXPECT_EQ(messages[0].end, ros::Time(10.0));
}

// 2 h at 1 m/s are 7200 poses 1 m apart: a path with 200 n of them comes n s after the one before.
TEST(BeliefPublisher, ALongPathIsGivenOutLessOften) {
  OutputOptions options;
  options.path_period = 2.0;
  options.path_spacing = 1.0;
  Publisher publisher(options);
  std::size_t poses = 0;
  for (int second = 0; second < 7200; ++second) {
    const ros::Time stamp(1.0 + second);
    publisher.belief.publish_pose(stamp, sure({1.0 * second, 0.0, 0.0}), {});
    publisher.belief.publish_path(stamp);
    if (second == 300) {
      EXPECT_EQ(publisher.out.paths.size(), 151u) << "short ones every 2 s";
    }
  }
  for (const nav_msgs::Path& path : publisher.out.paths) poses += path.poses.size();
  EXPECT_LT(poses, 200u * 7200u);
  publisher.belief.hurry_path();
  publisher.belief.publish_path(ros::Time(7201.0));
  EXPECT_EQ(publisher.out.paths.back().poses.size(), 7200u);
}

// In a maze of 2.4 m, poses half a metre apart would cut the corners.
TEST(BeliefPublisher, ATightTurnIsOnThePath) {
  OutputOptions options;
  options.path_period = 0.0;
  options.path_spacing = 0.5;
  Publisher publisher(options);
  for (int step = 0; step <= 62; ++step) {  // once round a circle of 0.2 m
    const double turn = 0.1 * step;
    publisher.belief.publish_pose(
        ros::Time(1.0 + step), sure({0.2 * std::sin(turn), 0.2 - 0.2 * std::cos(turn), turn}), {});
    publisher.belief.publish_path(ros::Time(1.0 + step));
  }
  EXPECT_GE(publisher.out.paths.back().poses.size(), 16u) << "6.2 rad in steps of 0.3 to 0.4";
  EXPECT_LE(publisher.out.paths.back().poses.size(), 22u);
}

// It may drive for days: every other pose goes, the first and the last drive on, and the steps
// between are twice as long from then on.
TEST(BeliefPublisher, APathThatGetsTooLongIsThinned) {
  OutputOptions options;
  options.path_period = 0.0;
  options.path_spacing = 0.5;
  options.path_length = 10;
  Publisher publisher(options);
  for (int step = 0; step < 200; ++step) {
    publisher.belief.publish_pose(ros::Time(1.0 + step), sure({0.5 * step, 0.0, 0.0}), {});
    publisher.belief.publish_path(ros::Time(1.0 + step));
    ASSERT_LE(publisher.out.paths.back().poses.size(), 10u) << step;
  }
  const auto& poses = publisher.out.paths.back().poses;
  EXPECT_GE(poses.size(), 5u);
  EXPECT_EQ(poses.front().pose.position.x, 0.0);
  EXPECT_GT(poses.back().pose.position.x, 80.0);
  const double spacing = poses[1].pose.position.x - poses[0].pose.position.x;
  EXPECT_GE(spacing, 8.0);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    EXPECT_EQ(poses[i].pose.position.x - poses[i - 1].pose.position.x, spacing) << i;
  }
}

}  // namespace
}  // namespace pf_resampling
