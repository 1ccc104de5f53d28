#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <pf_resampling/FilterStatus.h>
#include <pf_resampling/LandmarkMap.h>
#include <rosbag/bag.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "pf_resampling_core/test/temporary_directory.hpp"
#include "test/evaluated_bag.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/evaluation_report.hpp"

// evaluate_bag on what a filter says that makes a map.
namespace pf_resampling {
namespace {

using nlohmann::json;

/// A robot that drives a square of 20 m with a landmark at each corner, and a filter whose path is
/// that path seen from its own frame, 0.2 m shorter to each side of the middle, and whose map is
/// likewise; one landmark is there twice.
class EvaluateSlamBag : public EvaluatedBag {
 protected:
  static constexpr double kShrink = 0.98;  // about the middle, (10, 10)

  std::string slam_bag(const Pose2& frame, bool with_initial_pose, int first_id,
                       const std::string& loaded_map = "") const {
    std::string path = directory_.file("slam.bag");
    BagWriter bag(path);
    const ros::Time start(kEvaluatedStart);
    const double corners[4][2] = {{0, 0}, {20, 0}, {20, 20}, {0, 20}};
    const auto seen = [&](double x, double y) {
      return relative(frame, {10.0 + kShrink * (x - 10.0), 10.0 + kShrink * (y - 10.0), 0.0});
    };
    LandmarkMap real, estimated;
    real.header.frame_id = estimated.header.frame_id = "map";
    for (int i = 0; i < 4; ++i) {
      Landmark landmark;
      landmark.id = 10 + i;
      landmark.position.x = corners[i][0];
      landmark.position.y = corners[i][1];
      real.landmarks.push_back(landmark);
      const Pose2 there = seen(corners[i][0], corners[i][1]);
      landmark.id = first_id + i;
      landmark.position.x = there.x;
      landmark.position.y = there.y;
      landmark.covariance[0] = landmark.covariance[3] = 0.04;
      estimated.landmarks.push_back(landmark);
    }
    estimated.landmarks.push_back(estimated.landmarks[0]);
    estimated.landmarks.back().id = 77;
    estimated.landmarks.back().position.x += 0.5;
    bag.write_latched("/ground_truth_landmarks", start, real);
    if (with_initial_pose) {
      geometry_msgs::PoseWithCovarianceStamped initial;
      bag.write("/initialpose", start, initial);
    }
    for (int i = 0; i <= 400; ++i) {
      const ros::Time time(kEvaluatedStart + 0.1 * i);
      const int side = std::min(i / 100, 3);
      const double along = 0.2 * (i - 100 * side);
      const double* from = corners[side];
      const double heading = 0.5 * kPi * side;
      const double x = from[0] + along * std::cos(heading);
      const double y = from[1] + along * std::sin(heading);
      geometry_msgs::PoseStamped truth;
      truth.header.stamp = time;
      truth.pose = pose_at(x, y, heading);
      bag.write("/ground_truth", time, truth);
      nav_msgs::Odometry odometry;
      odometry.header.stamp = time;
      odometry.pose.pose = pose_at(x, y, heading);
      bag.write("/odom", time, odometry);
      geometry_msgs::PoseWithCovarianceStamped pose;
      pose.header.stamp = time;
      const Pose2 there = seen(x, y);
      pose.pose.pose = pose_at(there.x, there.y, wrap_angle(heading - frame.heading));
      pose.pose.covariance[0] = pose.pose.covariance[7] = pose.pose.covariance[35] = 0.04;
      bag.write("/pose", time, pose);
      FilterStatus status;
      status.header.stamp = time;
      status.particles = 100;
      status.map_file = loaded_map;
      status.effective_sample_size = i % 2 == 0 ? 40.0 : 80.0;
      // Only those of the renewals count.
      status.distinct_ancestors_of_renewal = i % 2 == 1 ? 30 : 80;
      status.distinct_ancestors_since_start = 7;
      status.updates = static_cast<std::uint64_t>(i) + 1;
      status.renewals = static_cast<std::uint64_t>(i / 2);
      status.renewed = i % 2 == 1;
      status.health = i < 100 ? "converging" : i < 300 ? "healthy" : "depleted";
      bag.write("/status", time, status);
    }
    bag.write("/landmark_map", ros::Time(kEvaluatedStart + 40.0), LandmarkMap());
    bag.write("/landmark_map", ros::Time(kEvaluatedStart + 40.1), estimated);
    bag.finish();
    return path;
  }
};

// 401 true poses; what was said at the stamp of each.
TEST_F(EvaluateSlamBag, SumsUpWhatTheFilterSaidOfItsHealth) {
  const json health = evaluate(slam_bag({0.0, 0.0, 0.0}, false, 0))["health"];
  EXPECT_NEAR(health["shares"]["converging"], 100.0 / 401.0, 1e-9);
  EXPECT_NEAR(health["shares"]["healthy"], 200.0 / 401.0, 1e-9);
  EXPECT_NEAR(health["shares"]["depleted"], 101.0 / 401.0, 1e-9);
  EXPECT_EQ(health["shares"].size(), 3u);
  EXPECT_EQ(health["wrong_when_healthy"], 0.0);
}

TEST(HealthShares, CountHowOftenHealthyWasWrong) {
  PathErrors errors;
  errors.coverage_3sigma = 0.5;
  for (int i = 0; i < 10; ++i) {
    PathErrorSample sample;
    sample.time = i;
    sample.is_clipped = i == 0;
    sample.normalized_squared = i % 2 == 0 ? 1.0 : 9.5;
    errors.samples.push_back(sample);
  }
  EXPECT_FALSE(health_shares({}, errors));
  // Nothing said at 1; healthy at 2, 3 and 4; lost from 5 on.
  const auto found = health_shares({{1.5, "healthy", 1}, {5.0, "lost", 2}}, errors);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->shares.at("starting"), 1.0 / 9.0, 1e-12);
  EXPECT_NEAR(found->shares.at("healthy"), 3.0 / 9.0, 1e-12);
  EXPECT_NEAR(found->shares.at("lost"), 5.0 / 9.0, 1e-12);
  EXPECT_NEAR(*found->wrong_when_healthy, 1.0 / 3.0, 1e-12);
  EXPECT_NEAR(found->several_places, 5.0 / 9.0, 1e-12);
  errors.coverage_3sigma.reset();
  EXPECT_FALSE(health_shares({{1.5, "healthy", 0}}, errors)->wrong_when_healthy);
}

TEST_F(EvaluateSlamBag, JudgesMapAndShapeWhateverTheFrame) {
  const json result = evaluate(slam_bag({3.0, -2.0, 0.7}, false, 10));
  EXPECT_EQ(result["frame"], "start");
  const json& map = result["map"];
  EXPECT_EQ(map["landmarks"], 5);
  EXPECT_EQ(map["false_landmarks"], 1);
  EXPECT_EQ(map["missed"], 0);
  EXPECT_EQ(map["matched_by"], "id");
  // Laid on the truth at the first corner: the others are 0, 0.4, 0.4 * sqrt(2) and 0.4 m off.
  EXPECT_NEAR(map["rms"], 0.4 * std::sqrt((1.0 + 2.0 + 1.0) / 4.0), 1e-6);
  // A smaller square in the middle of the larger: each corner is 0.2 * sqrt(2) m off.
  EXPECT_NEAR(map["rms_aligned"], 0.2 * std::sqrt(2.0), 1e-6);
  // Squared distances over 0.04 m^2: 0, 4, 8, 4; 5.991 is the limit.
  EXPECT_NEAR(map["coverage95"], 0.75, 1e-9);
  EXPECT_NEAR(map["normalized_error"], 4.0, 1e-6);
  // Of the path the smaller square is 0.2 m inside at the middle of a side, 0.2 sqrt(2) at corners.
  const json& aligned = result["estimate"]["cartesian_aligned"];
  EXPECT_NEAR(aligned["max"], 0.2 * std::sqrt(2.0), 1e-3);
  // The mean of 0.2 sqrt(1 + s^2) over s in [0, 1] is 0.1 (sqrt(2) + asinh(1)).
  EXPECT_NEAR(aligned["mean"], 0.1 * (std::sqrt(2.0) + std::asinh(1.0)), 1e-3);
  EXPECT_GT(aligned["std"], 0.0);
  EXPECT_NEAR(result["dead_reckoning"]["cartesian_aligned"]["max"], 0.0, 1e-6);
  const json& filter = result["filter"];
  EXPECT_EQ(filter["renewals"], 200);
  EXPECT_EQ(filter["particles"], 100);
  EXPECT_NEAR(filter["mean_distinct_ancestors_of_renewal"], 30.0, 1e-9);
  EXPECT_EQ(filter["distinct_ancestors_since_start"], 7);
  EXPECT_NEAR(filter["mean_effective_sample_size"], (201 * 40.0 + 200 * 80.0) / 401.0, 1e-9);
}

TEST_F(EvaluateSlamBag, CallsNoRobotLostThatHasAFrameOfItsOwn) {
  const std::string bag = slam_bag({3.0, -2.0, 0.7}, false, 10);
  const auto text_of = [&](const std::string& options) {
    return run_program("evaluate_bag " + bag + options).out;
  };
  EXPECT_FALSE(says(text_of(""), "lost:"));
  EXPECT_TRUE(says(text_of(" --frame given"), "lost:"));
}

TEST_F(EvaluateSlamBag, MatchesByNearestWhereIdsMeanNothing) {
  const json map = evaluate(slam_bag({3.0, -2.0, 0.7}, false, 0))["map"];
  EXPECT_EQ(map["matched_by"], "nearest");
  EXPECT_EQ(map["false_landmarks"], 1);
  EXPECT_NEAR(map["rms_aligned"], 0.2 * std::sqrt(2.0), 0.1);
}

TEST_F(EvaluateSlamBag, LeavesTheFrameWhereItWasGiven) {
  const std::string bag = slam_bag({3.0, -2.0, 0.0}, true, 10);
  json result = evaluate(bag);
  EXPECT_EQ(result["frame"], "given");
  EXPECT_GT(result["map"]["rms"], 3.0);
  EXPECT_NEAR(result["map"]["rms_aligned"], 0.2 * std::sqrt(2.0), 1e-6);
  result = evaluate(bag + " --frame fit");
  EXPECT_NEAR(result["estimate"]["cartesian"]["mean"],
              result["estimate"]["cartesian_aligned"]["mean"], 1e-9);
}

TEST_F(EvaluateSlamBag, LeavesTheFrameOfALoadedMapWhereItIs) {
  const std::string bag = slam_bag({3.0, -2.0, 0.0}, false, 10, "site.csv");
  const json result = evaluate(bag);
  EXPECT_EQ(result["frame"], "given");
  EXPECT_GT(result["map"]["rms"], 3.0);
  const ProgramResult said = run_program("evaluate_bag " + bag);
  EXPECT_TRUE(says(said.out, "loaded map, site.csv"));
}

TEST_F(EvaluateSlamBag, PrintsAndDrawsTheMap) {
  const std::string bag = slam_bag({3.0, -2.0, 0.7}, false, 10);
  const ProgramResult result = run_program("evaluate_bag " + bag);
  EXPECT_EQ(result.exit_code, 0) << result.error;
  for (const char* text : {"Cartesian, aligned (m)", "5 landmarks, 4 of 4 true ones", "1 false",
                           "0.400 m, aligned 0.283 m", "first true pose", "401 / 200"}) {
    EXPECT_TRUE(says(result.out, text));
  }
  if (std::system("/usr/bin/python3 -c 'import matplotlib' 2>/dev/null") != 0) {
    GTEST_SKIP() << "matplotlib is not installed";
  }
  const std::string picture = directory_.file("out.png");
  EXPECT_EQ(run_program("evaluate_bag " + bag + " --quiet --plot " + picture).error, "");
  EXPECT_EQ(read_file(picture).substr(1, 3), "PNG");
}

TEST_F(EvaluateSlamBag, ComparesWithTheBatchSolution) {
  const std::string bag = directory_.file("loops.bag");
  // The dead reckoning of the reference world as the "filter": the batch solution is better.
  ASSERT_EQ(run_program("simulate_bag indoor_two_loops " + bag).exit_code, 0);
  const std::string arguments = bag + " --pose /odom --batch";
  const json result = evaluate(arguments + " --batch-online");
  EXPECT_GT(result["batch_ratio"], 1.5);
  EXPECT_NEAR(result["batch_ratio"],
              result["estimate"]["cartesian_aligned"]["mean"].get<double>() /
                  result["batch"]["cartesian_aligned"]["mean"].get<double>(),
              1e-9);
  EXPECT_EQ(result["batch"]["map"]["matched"], 30);
  EXPECT_EQ(result["batch"]["observations"], 327);
  EXPECT_EQ(result["batch"]["ids"], "observations");
  EXPECT_LT(result["batch"]["map"]["rms_aligned"], 0.2);
  // What knows the past only is worse, and still better than dead reckoning.
  const json online = result["batch"]["online"];
  EXPECT_EQ(online["refused"], 0);
  EXPECT_GT(online["cartesian_aligned"]["mean"], result["batch"]["cartesian_aligned"]["mean"]);
  EXPECT_NEAR(online["ratio"],
              result["estimate"]["cartesian"]["mean"].get<double>() /
                  online["cartesian"]["mean"].get<double>(),
              1e-9);
  EXPECT_GT(online["aligned_ratio"], 1.2);

  const std::string hidden = directory_.file("hidden.bag");
  ASSERT_EQ(run_program("simulate_bag indoor_two_loops " + hidden + " --unknown-ids").exit_code, 0);
  const ProgramResult unknown = run_program("evaluate_bag " + hidden + " --pose /odom --batch");
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_TRUE(unknown.is_one_line_error("evaluate_bag")) << unknown.error;
  EXPECT_TRUE(says(unknown.error, "no filter's path and map"));
}

// The drive of the reference world without ids, which the filter finds: with these the solution is
// as good as with the true ones. A sighting or two may be farther off than the gate.
TEST_F(EvaluateSlamBag, ComparesWithTheBatchSolutionOfTheFiltersOwnAssociations) {
  const std::string hidden = directory_.file("hidden.bag"), run = directory_.file("run.bag");
  ASSERT_EQ(run_program("simulate_bag indoor_two_loops " + hidden + " --unknown-ids").exit_code, 0);
  const ProgramResult filter = run_program("run_bag fastslam " + hidden + " " + run);
  ASSERT_EQ(filter.exit_code, 0) << filter.error;
  const json batch = evaluate(run + " --batch")["batch"];
  EXPECT_EQ(batch["ids"], "filter");
  EXPECT_GE(batch["observations"], 325);
  EXPECT_EQ(batch["map"]["matched_by"], "nearest");
  EXPECT_EQ(batch["map"]["matched"], 30);
  EXPECT_EQ(batch["map"]["false_landmarks"], 0);
  EXPECT_LT(batch["map"]["rms_aligned"], 0.2);
}

}  // namespace
}  // namespace pf_resampling
