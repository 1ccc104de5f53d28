#include <geometry_msgs/PointStamped.h>
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <pf_resampling/BeaconArray.h>
#include <tf2_msgs/TFMessage.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "pf_resampling_core/test/says.hpp"
#include "test/evaluated_bag.hpp"
#include "tools/common/bag.hpp"

namespace pf_resampling {
namespace {

using nlohmann::json;

constexpr double kHeading = 0.5;  // rad
constexpr int kPoses = 501;       // at 10 Hz

struct BagOptions {
  bool with_truth = true;
  bool with_heading = true;
  bool with_pose = true;
  double scale = 1.1;                 // of dead reckoning
  double x_of_last_pose = 0.0;        // m, added
  double x_of_middle_odometry = 0.0;  // m, added
  std::string antenna;                // frame 2 m before and 1 m right of the robot's
};

// 50 m along a line; the estimate 1 m beside it, 20 m in the first tenth; dead reckoning too long;
// a variance of 1 m^2 per axis.
void write_bag(const std::string& path, const BagOptions& options) {
  BagWriter bag(path);
  const ros::Time start(kEvaluatedStart);
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
    const ros::Time time(kEvaluatedStart + 0.1 * i);
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
    if (i == kPoses / 2) odometry.pose.pose.position.x += options.x_of_middle_odometry;
    bag.write("/odom", time, odometry);
    if (!options.with_pose) continue;
    geometry_msgs::PoseWithCovarianceStamped pose;
    pose.header = header;
    const double left = i < kPoses / 10 ? 20.0 : 1.0;
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

class EvaluateBag : public EvaluatedBag {
 protected:
  std::string bag_with(const BagOptions& options) const {
    write_bag(directory_.file("run.bag"), options);
    return directory_.file("run.bag");
  }
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

TEST_F(EvaluateBag, PrintsATableAndCanBeQuiet) {
  const std::string bag = bag_with({});
  const ProgramResult loud = run_program("evaluate_bag " + bag + " --clip 0.2");
  EXPECT_EQ(loud.exit_code, 0);
  for (const char* text :
       {"cross-track (m)", "along-track (m)", "Cartesian (m)", "heading (rad)", "dead reckoning",
        "1.000", "3.000", "95 %", "converge", "5.0 s", "lost"}) {
    EXPECT_TRUE(says(loud.out, text));
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

// Names of files are bytes, not always UTF-8.
TEST_F(EvaluateBag, TakesANameOfAnyBytes) {
  const std::string bag = directory_.file("run_\xff\xfe.bag");
  std::filesystem::rename(bag_with({}), bag);
  const std::string file = directory_.file("out.json");
  const ProgramResult result = run_program("evaluate_bag " + bag + " --quiet --json " + file);
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_TRUE(json::accept(read_file(file)));
  if (std::system("/usr/bin/python3 -c 'import matplotlib' 2>/dev/null") != 0) return;
  const ProgramResult drawn =
      run_program("evaluate_bag " + bag + " --quiet --plot " + directory_.file("out.png"));
  EXPECT_EQ(drawn.exit_code, 0) << drawn.error;
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
  EXPECT_TRUE(says(result.out, "no /ground_truth"));
  EXPECT_EQ(read_file(picture).substr(1, 3), "PNG");
}

TEST_F(EvaluateBag, NamesWhatIsMissing) {
  BagOptions options;
  options.with_pose = false;
  ProgramResult result = run_program("evaluate_bag " + bag_with(options));
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_TRUE(result.is_one_line_error("evaluate_bag")) << result.error;
  for (const char* topic : {"/pose", "/odom", "/ground_truth", "/beacons"}) {
    EXPECT_TRUE(says(result.error, topic));
  }
  options = {};
  options.with_truth = false;
  result = run_program("evaluate_bag " + bag_with(options));
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_TRUE(result.is_one_line_error("evaluate_bag")) << result.error;
  EXPECT_TRUE(says(result.error, "no /ground_truth"));
}

TEST_F(EvaluateBag, RefusesBadInputInOneLine) {
  const std::string bag = bag_with({});
  const std::string whole = read_file(bag);
  const std::string truncated =
      directory_.write("truncated.bag", whole.substr(0, whole.size() / 2));
  const std::string text = directory_.write("text.bag", "not a bag\n");
  for (const std::string& arguments :
       {directory_.file("missing.bag"), truncated, text, directory_.path(), bag + " --clip 1.5",
        bag + " --clip -0.1", bag + " --plot picture.bmp",
        bag + " --json " + directory_.file("no/such/folder.json") + " --quiet",
        bag + " --pose /odometry"}) {
    const ProgramResult result = run_program("evaluate_bag " + arguments);
    EXPECT_EQ(result.exit_code, 1) << arguments;
    EXPECT_TRUE(result.is_one_line_error("evaluate_bag")) << arguments << "\n" << result.error;
  }
  for (const std::string& arguments :
       {std::string(), bag + " --klip 0.2", bag + " --clip x", bag + " --match best",
        bag + " --frame mine", bag + " --batch --odom none", bag + " --batch-online"}) {
    const ProgramResult result = run_program("evaluate_bag " + arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments;
    EXPECT_TRUE(result.is_one_line_error("evaluate_bag")) << arguments << "\n" << result.error;
  }
}

TEST_F(EvaluateBag, NamesTheBeaconThatIsNotAsListed) {
  const std::string good = directory_.file("good.bag");
  const std::string bad = directory_.file("bad.bag");
  ASSERT_EQ(run_program("simulate_bag beacons_figure8 " + good + " --duration 120").exit_code, 0);
  {
    const rosbag::Bag bag = open_bag(good);
    BagWriter writer(bad);
    for_each_in_order(bag, good, {}, [&](const rosbag::MessageInstance& message) {
      const auto beacons = message.instantiate<BeaconArray>();
      if (!beacons) return writer.copy(message);
      beacons->beacons[2].position.x += 4.0;
      writer.write_latched(message.getTopic(), message.getTime(), *beacons);
    });
    writer.finish();
  }
  const json batch = evaluate(bad + " --pose /odom --batch")["batch"];
  ASSERT_EQ(batch["ranges"]["remarks"].size(), 1u);
  EXPECT_TRUE(says(batch["ranges"]["remarks"][0], "beacon 3 is listed "));
}

TEST_F(EvaluateBag, ComparesWithTheBatchSolutionOfRanges) {
  const std::string bag = directory_.file("figure8.bag");
  ASSERT_EQ(run_program("simulate_bag beacons_figure8 " + bag + " --duration 60").exit_code, 0);
  // The dead reckoning as the "filter": it says nothing of where the beacons are.
  const std::string arguments = bag + " --pose /odom --clip 0.2 --batch --batch-online";
  const json result = evaluate(arguments);
  const json batch = result["batch"];
  // Ranges of 0.4 m, six a second: the path is good to a few decimetres, on line as well.
  EXPECT_LT(batch["cartesian"]["mean"], 0.3);
  EXPECT_LT(batch["online"]["cartesian"]["mean"], 0.4);
  EXPECT_GT(batch["online"]["cartesian"]["mean"], batch["cartesian"]["mean"]);
  EXPECT_EQ(batch["online"]["refused"], 0);
  EXPECT_EQ(batch["observations"], 360);
  ASSERT_EQ(batch["ranges"]["radios"].size(), 6u);
  EXPECT_EQ(batch["ranges"]["radios"][0]["beacon"], 1);
  EXPECT_TRUE(batch["ranges"]["remarks"].empty());
  EXPECT_GT(batch["online"]["ratio"], 2.0);
  const ProgramResult text = run_program("evaluate_bag " + arguments);
  for (const char* said :
       {"batch solution of the same data", "it found: ranges to", "on-line bound"}) {
    EXPECT_TRUE(says(text.out, said));
  }

  // Neither landmarks nor ranges.
  const ProgramResult nothing = run_program("evaluate_bag " + bag_with({}) + " --batch");
  EXPECT_EQ(nothing.exit_code, 1);
  EXPECT_TRUE(nothing.is_one_line_error("evaluate_bag")) << nothing.error;
  EXPECT_TRUE(says(nothing.error, "/landmarks"));
}

// The filter rejected that message and went on.
TEST_F(EvaluateBag, OdometryThatIsNotFiniteIsLeftOutAndSaid) {
  BagOptions options;
  options.x_of_middle_odometry = std::numeric_limits<double>::quiet_NaN();
  const ProgramResult result = run_program("evaluate_bag " + bag_with(options));
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_TRUE(says(result.out, "1 of 501 messages of /odom left out"));
  EXPECT_TRUE(says(result.out, "dead reckoning"));
}

TEST_F(EvaluateBag, SaysThatTheEstimateIsNotFinite) {
  BagOptions options;
  options.x_of_last_pose = std::numeric_limits<double>::quiet_NaN();
  const ProgramResult result = run_program("evaluate_bag " + bag_with(options));
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_TRUE(result.is_one_line_error("evaluate_bag")) << result.error;
  EXPECT_TRUE(says(result.error, "/pose: pose 501 of 501 is not finite"));
}

}  // namespace
}  // namespace pf_resampling