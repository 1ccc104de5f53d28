#include <geometry_msgs/PointStamped.h>
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <pf_resampling/BeaconArray.h>
#include <pf_resampling/FilterStatus.h>
#include <pf_resampling/LandmarkMap.h>
#include <pf_resampling/ParticleErrors.h>
#include <tf2_msgs/TFMessage.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "batch/batch_slam.hpp"
#include "common/bag.hpp"
#include "common/files.hpp"
#include "pf_resampling_core/geometry.hpp"
#include "run_program.hpp"

namespace pf_resampling {
namespace {

using nlohmann::json;

constexpr double kStart = 1000.0;  // s
constexpr double kHeading = 0.5;   // rad
constexpr int kPoses = 501;        // at 10 Hz

geometry_msgs::Pose pose_at(double x, double y, double heading) {
  geometry_msgs::Pose pose;
  pose.position.x = x;
  pose.position.y = y;
  pose.orientation.z = std::sin(0.5 * heading);
  pose.orientation.w = std::cos(0.5 * heading);
  return pose;
}

struct BagOptions {
  bool with_truth = true;
  bool with_heading = true;
  bool with_pose = true;
  double lateral = 1.0;         // m, of the estimate, to the left; 20 m in the first tenth
  double scale = 1.1;           // of dead reckoning
  double x_of_last_pose = 0.0;  // m, added
  std::string antenna;          // frame 2 m before and 1 m right of the robot's
};

// 50 m along a line; the estimate beside it, dead reckoning too long; a variance of 1 m^2 per axis.
void write_bag(const std::string& path, const BagOptions& options) {
  BagWriter bag(path);
  const ros::Time start(kStart);
  BeaconArray beacons;
  beacons.header.frame_id = "map";
  beacons.header.stamp = start;
  beacons.beacons.resize(1);
  bag.write_latched("/beacons", start, beacons);
  if (!options.antenna.empty()) {
    tf2_msgs::TFMessage frames;
    frames.transforms.resize(1);
    frames.transforms[0].header.stamp = start;
    frames.transforms[0].header.frame_id = "base_link";
    frames.transforms[0].child_frame_id = options.antenna;
    frames.transforms[0].transform.translation.x = 2.0;
    frames.transforms[0].transform.translation.y = -1.0;
    frames.transforms[0].transform.rotation.w = 1.0;
    bag.write_latched("/tf_static", start, frames);
  }
  for (int i = 0; i < kPoses; ++i) {
    const ros::Time time(kStart + 0.1 * i);
    const double s = 0.1 * i;
    std_msgs::Header header;
    header.stamp = time;
    header.frame_id = "map";
    const double x = 3.0 + s * std::cos(kHeading);
    const double y = -2.0 + s * std::sin(kHeading);
    if (options.with_truth && options.with_heading) {
      geometry_msgs::PoseStamped truth;
      truth.header = header;
      truth.pose = pose_at(x, y, kHeading);
      bag.write("/ground_truth", time, truth);
    } else if (options.with_truth) {
      geometry_msgs::PointStamped truth;
      truth.header = header;
      truth.point.x = x;
      truth.point.y = y;
      bag.write("/ground_truth", time, truth);
    }
    nav_msgs::Odometry odometry;
    odometry.header = header;
    odometry.header.frame_id = "odom";
    odometry.pose.pose = pose_at(options.scale * s, 0.0, 0.0);
    bag.write("/odom", time, odometry);
    if (!options.with_pose) continue;
    geometry_msgs::PoseWithCovarianceStamped pose;
    pose.header = header;
    const double left = i < kPoses / 10 ? 20.0 : options.lateral;
    pose.pose.pose =
        pose_at(x - left * std::sin(kHeading), y + left * std::cos(kHeading), kHeading + 0.1);
    if (i + 1 == kPoses) pose.pose.pose.position.x += options.x_of_last_pose;
    pose.pose.covariance[0] = 1.0;
    pose.pose.covariance[7] = 1.0;
    pose.pose.covariance[35] = 1.0;
    bag.write("/pose", time, pose);
  }
  bag.finish();
}

class EvaluateBag : public ::testing::Test {
 protected:
  std::string bag_with(const BagOptions& options) const {
    write_bag(directory_.file("run.bag"), options);
    return directory_.file("run.bag");
  }
  json evaluate(const std::string& arguments) const {
    const std::string file = directory_.file("out.json");
    const ProgramResult result = run_program("evaluate_bag " + arguments + " --json " + file);
    EXPECT_EQ(result.exit_code, 0) << result.error;
    EXPECT_EQ(result.error, "");
    return json::parse(read_file(file));
  }
  TemporaryDirectory directory_;
};

TEST_F(EvaluateBag, WritesTheErrorsOfEstimateAndDeadReckoning) {
  const json result = evaluate(bag_with({}) + " --clip 0.2");
  const json& estimate = result["estimate"];
  EXPECT_NEAR(estimate["cross_track"]["mean"], 1.0, 1e-6);
  EXPECT_NEAR(estimate["cross_track"]["max"], 1.0, 1e-6);
  EXPECT_NEAR(estimate["cross_track"]["std"], 0.0, 1e-6);
  EXPECT_NEAR(estimate["along_track"]["max"], 0.0, 1e-6);
  EXPECT_NEAR(estimate["cartesian"]["mean"], 1.0, 1e-6);
  EXPECT_NEAR(estimate["heading"]["mean"], 0.1, 1e-6);
  EXPECT_EQ(estimate["coverage95"], 1.0);
  EXPECT_EQ(estimate["lost"], false);
  EXPECT_EQ(result["coverage95"], 1.0);
  EXPECT_EQ(result["lost"], false);
  // Off by 20 m for the first 50 poses: 5 s.
  EXPECT_NEAR(result["converged_after"], 5.0, 1e-6);
  EXPECT_NEAR(estimate["converged_after"], 5.0, 1e-6);
  // Dead reckoning is 10 % too long: from 1 m at 10 s to 5 m at 50 s, uniformly.
  const json& dead_reckoning = result["dead_reckoning"];
  EXPECT_NEAR(dead_reckoning["along_track"]["mean"], 3.0, 1e-6);
  EXPECT_NEAR(dead_reckoning["along_track"]["max"], 5.0, 1e-6);
  EXPECT_NEAR(dead_reckoning["along_track"]["std"], 4.0 / std::sqrt(12.0), 0.005);
  EXPECT_NEAR(dead_reckoning["cross_track"]["max"], 0.0, 1e-6);
  EXPECT_NEAR(dead_reckoning["heading"]["max"], 0.0, 1e-6);
}

TEST_F(EvaluateBag, CountsTheWholeRunUnlessToldToClip) {
  const json result = evaluate(bag_with({}));
  EXPECT_NEAR(result["estimate"]["cartesian"]["mean"], (50.0 * 20.0 + 451.0) / 501.0, 1e-6);
  EXPECT_NEAR(result["estimate"]["coverage95"], 451.0 / 501.0, 1e-9);
}

TEST_F(EvaluateBag, DoesWithoutATrueHeading) {
  BagOptions options;
  options.with_heading = false;
  const json result = evaluate(bag_with(options) + " --clip 0.2");
  EXPECT_NEAR(result["estimate"]["cross_track"]["mean"], 1.0, 1e-6);
  EXPECT_NEAR(result["dead_reckoning"]["along_track"]["mean"], 3.0, 1e-6);
  EXPECT_TRUE(result["estimate"]["heading"]["mean"].is_null());
}

// The estimate is 1 m left of the truth and turned by 0.1: that is where it puts its antenna.
TEST_F(EvaluateBag, TheTruthMayBeThatOfAnAntenna) {
  BagOptions options;
  options.with_heading = false;
  for (const std::string name : {"ground_truth", "gps"}) {
    options.antenna = name;
    const std::string wanted = name == "gps" ? " --truth-frame gps" : "";
    const json result = evaluate(bag_with(options) + " --clip 0.2" + wanted);
    EXPECT_NEAR(result["estimate"]["cross_track"]["mean"],
                1.0 + 2.0 * std::sin(0.1) - std::cos(0.1), 1e-6);
    EXPECT_NEAR(result["estimate"]["along_track"]["mean"], 2.0 * std::cos(0.1) + std::sin(0.1),
                1e-6);
  }
  const ProgramResult refused =
      run_program("evaluate_bag " + bag_with(options) + " --truth-frame mast");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_EQ(refused.error,
            "evaluate_bag: --truth-frame mast: /tf_static does not place it on base_link; give one "
            "that it does\n");
}

TEST_F(EvaluateBag, SaysWhenTheRobotIsLost) {
  BagOptions options;
  options.lateral = 4.0;  // the extent is 50 m: lost above 1.7 m
  const std::string bag = bag_with(options);
  EXPECT_EQ(evaluate(bag)["lost"], true);
  EXPECT_TRUE(evaluate(bag)["converged_after"].is_null());
  EXPECT_EQ(evaluate(bag + " --lost-error 4.1")["lost"], false);
}

TEST_F(EvaluateBag, PrintsATableAndCanBeQuiet) {
  const std::string bag = bag_with({});
  const ProgramResult loud = run_program("evaluate_bag " + bag + " --clip 0.2");
  EXPECT_EQ(loud.exit_code, 0);
  for (const char* text :
       {"cross-track (m)", "along-track (m)", "Cartesian (m)", "heading (rad)", "dead reckoning",
        "1.000", "3.000", "95 %", "converge", "5.0 s", "lost"}) {
    EXPECT_NE(loud.out.find(text), std::string::npos) << text << "\n" << loud.out;
  }
  const ProgramResult quiet = run_program("evaluate_bag " + bag + " --quiet");
  EXPECT_EQ(quiet.exit_code, 0);
  EXPECT_EQ(quiet.out + quiet.error, "");
}

TEST_F(EvaluateBag, DrawsAPicture) {
  if (std::system("/usr/bin/python3 -c 'import matplotlib' 2>/dev/null") != 0) {
    GTEST_SKIP() << "matplotlib is not installed";
  }
  const std::string picture = directory_.file("out.png");
  const ProgramResult result =
      run_program("evaluate_bag " + bag_with({}) + " --clip 0.2 --quiet --plot " + picture);
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_EQ(read_file(picture).substr(1, 3), "PNG");
  EXPECT_GT(read_file(picture).size(), 20000u);
  EXPECT_EQ(directory_.listing(), "out.png run.bag");
}

TEST_F(EvaluateBag, DrawsThePathsAloneWithoutTruth) {
  if (std::system("/usr/bin/python3 -c 'import matplotlib' 2>/dev/null") != 0) {
    GTEST_SKIP() << "matplotlib is not installed";
  }
  BagOptions options;
  options.with_truth = false;
  const std::string picture = directory_.file("out.png");
  const ProgramResult result =
      run_program("evaluate_bag " + bag_with(options) + " --plot " + picture);
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_NE(result.out.find("no /ground_truth"), std::string::npos) << result.out;
  EXPECT_EQ(read_file(picture).substr(1, 3), "PNG");
}

/// A robot that drives a square of 20 m with a landmark at each corner, and a filter whose path is
/// that path seen from its own frame, 0.2 m shorter to each side of the middle, and whose map is
/// likewise; one landmark is there twice.
class EvaluateSlamBag : public EvaluateBag {
 protected:
  static constexpr double kShrink = 0.98;  // about the middle, (10, 10)

  std::string slam_bag(const Pose2& frame, bool with_initial_pose, int first_id,
                       bool with_particle_errors = false) const {
    std::string path = directory_.file("slam.bag");
    BagWriter bag(path);
    const ros::Time start(kStart);
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
      const ros::Time time(kStart + 0.1 * i);
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
      status.effective_sample_size = i % 2 == 0 ? 40.0 : 80.0;
      status.distinct_ancestors = 30;
      status.updates = static_cast<std::uint64_t>(i) + 1;
      status.renewals = static_cast<std::uint64_t>(i / 2);
      status.renewed = i % 2 == 1;
      bag.write("/status", time, status);
      if (i % 100 != 0 || !with_particle_errors) continue;
      // At 0, 10, 20, 30 and 40 s; at the first no particle has a landmark yet.
      ParticleErrors particles;
      particles.header.stamp = time;
      particles.features = i == 0 ? 0 : 400;
      particles.feature_rms = i == 0 ? 0.0 : 0.1 * side + (i == 400 ? 0.2 : 0.0);
      particles.position_rms = i == 100 ? 0.9 : 0.1;
      bag.write("/particle_errors", time, particles);
    }
    bag.write("/landmark_map", ros::Time(kStart + 40.0), LandmarkMap());
    bag.write("/landmark_map", ros::Time(kStart + 40.1), estimated);
    bag.finish();
    return path;
  }
};

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
  EXPECT_NEAR(filter["mean_distinct_ancestors"], 30.0, 1e-9);
  EXPECT_NEAR(filter["mean_effective_sample_size"], (201 * 40.0 + 200 * 80.0) / 401.0, 1e-9);
}

TEST_F(EvaluateSlamBag, CallsNoRobotLostThatHasAFrameOfItsOwn) {
  const std::string bag = slam_bag({3.0, -2.0, 0.7}, false, 10);
  const auto text_of = [&](const std::string& options) {
    return run_program("evaluate_bag " + bag + options).out;
  };
  EXPECT_EQ(text_of("").find("lost:"), std::string::npos);
  EXPECT_NE(text_of(" --frame given").find("lost:"), std::string::npos);
}

TEST_F(EvaluateSlamBag, SummarizesTheErrorsOfTheParticles) {
  EXPECT_EQ(evaluate(slam_bag({}, false, 10)).count("particles"), 0u);
  const std::string bag = slam_bag({}, false, 10, true);
  json particles = evaluate(bag)["particles"];
  EXPECT_EQ(particles["updates"], 5);
  // Of landmarks 0.1, 0.2, 0.3 and 0.5 m: an update before the first landmark has no such error.
  EXPECT_NEAR(particles["feature_rms"]["mean"], 0.275, 1e-9);
  EXPECT_NEAR(particles["feature_rms"]["max"], 0.5, 1e-9);
  EXPECT_NEAR(particles["feature_rms"]["last"], 0.5, 1e-9);
  EXPECT_NEAR(particles["position_rms"]["mean"], (4 * 0.1 + 0.9) / 5.0, 1e-9);
  EXPECT_NEAR(particles["position_rms"]["max"], 0.9, 1e-9);
  EXPECT_NEAR(particles["position_rms"]["last"], 0.1, 1e-9);
  // Of the first half nothing counts: 30 and 40 s are left.
  particles = evaluate(bag + " --clip 0.55")["particles"];
  EXPECT_EQ(particles["updates"], 2);
  EXPECT_NEAR(particles["feature_rms"]["mean"], 0.4, 1e-9);
  EXPECT_NEAR(particles["position_rms"]["max"], 0.1, 1e-9);

  const ProgramResult printed = run_program("evaluate_bag " + bag);
  for (const char* text :
       {"landmarks (K eq. 5), RMS:       mean 0.275 m, max 0.500 m, last 0.500 m",
        "positions (K eq. 6), RMS:       mean 0.260 m, max 0.900 m, last 0.100 m"}) {
    EXPECT_NE(printed.out.find(text), std::string::npos) << text << "\n" << printed.out;
  }
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

TEST_F(EvaluateSlamBag, PrintsAndDrawsTheMap) {
  const std::string bag = slam_bag({3.0, -2.0, 0.7}, false, 10);
  const ProgramResult result = run_program("evaluate_bag " + bag);
  EXPECT_EQ(result.exit_code, 0) << result.error;
  for (const char* text : {"Cartesian, aligned (m)", "5 landmarks, 4 of 4 true ones", "1 false",
                           "0.400 m, aligned 0.283 m", "first true pose", "401 / 200"}) {
    EXPECT_NE(result.out.find(text), std::string::npos) << text << "\n" << result.out;
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
  if (!has_batch_solver()) {
    const ProgramResult result = run_program("evaluate_bag " + arguments);
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_TRUE(result.is_one_line_error("evaluate_bag")) << result.error;
    EXPECT_NE(result.error.find("libceres-dev"), std::string::npos) << result.error;
    return;
  }
  const json result = evaluate(arguments);
  EXPECT_GT(result["batch_ratio"], 1.5);
  EXPECT_NEAR(result["batch_ratio"],
              result["estimate"]["cartesian_aligned"]["mean"].get<double>() /
                  result["batch"]["cartesian_aligned"]["mean"].get<double>(),
              1e-9);
  EXPECT_EQ(result["batch"]["map"]["matched"], 30);
  EXPECT_EQ(result["batch"]["observations"], 327);
  EXPECT_LT(result["batch"]["map"]["rms_aligned"], 0.2);

  const std::string hidden = directory_.file("hidden.bag");
  ASSERT_EQ(run_program("simulate_bag indoor_two_loops " + hidden + " --unknown-ids").exit_code, 0);
  const ProgramResult unknown = run_program("evaluate_bag " + hidden + " --pose /odom --batch");
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_TRUE(unknown.is_one_line_error("evaluate_bag")) << unknown.error;
  EXPECT_NE(unknown.error.find("known ids"), std::string::npos) << unknown.error;
}

TEST_F(EvaluateBag, NamesWhatIsMissing) {
  BagOptions options;
  options.with_pose = false;
  ProgramResult result = run_program("evaluate_bag " + bag_with(options));
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_TRUE(result.is_one_line_error("evaluate_bag")) << result.error;
  for (const char* topic : {"/pose", "/odom", "/ground_truth", "/beacons"}) {
    EXPECT_NE(result.error.find(topic), std::string::npos) << result.error;
  }
  options = {};
  options.with_truth = false;
  result = run_program("evaluate_bag " + bag_with(options));
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_TRUE(result.is_one_line_error("evaluate_bag")) << result.error;
  EXPECT_NE(result.error.find("no /ground_truth"), std::string::npos) << result.error;
}

TEST_F(EvaluateBag, RefusesBadInputInOneLine) {
  const std::string bag = bag_with({});
  const std::string whole = read_file(bag);
  const std::string truncated =
      directory_.write("truncated.bag", whole.substr(0, whole.size() / 2));
  const std::string text = directory_.write("text.bag", "not a bag\n");
  for (const std::string& arguments :
       {directory_.file("missing.bag"), truncated, text, directory_.path(), bag + " --clip 1.5",
        bag + " --clip -0.1", bag + " --lost-error -1", bag + " --plot picture.bmp",
        bag + " --json " + directory_.file("no/such/folder.json") + " --quiet",
        bag + " --pose /odometry"}) {
    const ProgramResult result = run_program("evaluate_bag " + arguments);
    EXPECT_EQ(result.exit_code, 1) << arguments;
    EXPECT_TRUE(result.is_one_line_error("evaluate_bag")) << arguments << "\n" << result.error;
  }
  for (const std::string& arguments :
       {std::string(), bag + " --klip 0.2", bag + " --clip x", bag + " --match best",
        bag + " --frame mine", bag + " --batch --odom none"}) {
    const ProgramResult result = run_program("evaluate_bag " + arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments;
    EXPECT_TRUE(result.is_one_line_error("evaluate_bag")) << arguments << "\n" << result.error;
  }
}

TEST_F(EvaluateBag, SaysThatTheEstimateIsNotFinite) {
  BagOptions options;
  options.x_of_last_pose = std::numeric_limits<double>::quiet_NaN();
  const ProgramResult result = run_program("evaluate_bag " + bag_with(options));
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_TRUE(result.is_one_line_error("evaluate_bag")) << result.error;
  EXPECT_NE(result.error.find("/pose: pose 501 of 501 is not finite"), std::string::npos)
      << result.error;
}

}  // namespace
}  // namespace pf_resampling
