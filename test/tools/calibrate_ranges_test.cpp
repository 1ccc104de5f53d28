#include <geometry_msgs/PointStamped.h>
#include <geometry_msgs/PoseStamped.h>
#include <gtest/gtest.h>
#include <pf_resampling/BeaconArray.h>
#include <pf_resampling/BeaconRange.h>
#include <tf2_msgs/TFMessage.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <map>

#include "pf_resampling_core/test/says.hpp"
#include "test/run_program.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/files.hpp"

namespace pf_resampling {
namespace {

constexpr double kAntenna[3] = {0.4, -0.3, 0.8};  // m, on the robot
constexpr double kPi = 3.14159265358979323846;

struct Calibration {
  double scale, bias;
};
const std::map<int, Calibration> kCalibrations = {{1, {1.05, 0.2}}, {2, {0.97, -0.1}}};
const std::map<int, std::vector<double>> kBeacons = {{1, {12.0, 1.0, 3.0}}, {2, {-9.0, 4.0, 0.0}}};

struct BagOptions {
  bool with_heading = true;
  bool with_beacons = true;
  bool with_frames = true;
  bool with_outliers = false;
};

// Two turns of a circle of 6 m, faster and slower, with two ranges at each pose, exact but for the
// radios' scale and bias; the heading is the direction of travel.
void write_bag(const std::string& path, const BagOptions& options) {
  BagWriter bag(path);
  const ros::Time start(500.0);
  if (options.with_beacons) {
    BeaconArray beacons;
    beacons.header.frame_id = "map";
    beacons.header.stamp = start;
    for (const auto& [id, place] : kBeacons) {
      BeaconPosition beacon;
      beacon.id = id;
      beacon.position.x = place[0];
      beacon.position.y = place[1];
      beacon.position.z = place[2];
      beacons.beacons.push_back(beacon);
    }
    bag.write_latched("/beacons", start, beacons);
  }
  if (options.with_frames) {
    // The antenna on a mast: two transforms.
    tf2_msgs::TFMessage frames;
    frames.transforms.resize(2);
    frames.transforms[0].header.frame_id = "mast";
    frames.transforms[0].child_frame_id = "antenna";
    frames.transforms[0].transform.translation.z = kAntenna[2];
    frames.transforms[0].transform.rotation.w = 1.0;
    frames.transforms[1].header.frame_id = "base_link";
    frames.transforms[1].child_frame_id = "mast";
    frames.transforms[1].transform.translation.x = kAntenna[0];
    frames.transforms[1].transform.translation.y = kAntenna[1];
    frames.transforms[1].transform.rotation.w = 1.0;
    bag.write_latched("/tf_static", start, frames);
  }
  for (int i = 0; i < 400; ++i) {
    const ros::Time time(500.0 + 0.1 * i);
    const double angle = 4.0 * kPi * i / 400.0;
    const double x = 6.0 * std::cos(angle);
    const double y = 6.0 * std::sin(angle);
    const double heading = angle + 0.5 * kPi;
    if (options.with_heading) {
      geometry_msgs::PoseStamped truth;
      truth.header.stamp = time;
      truth.header.frame_id = "map";
      truth.pose.position.x = x;
      truth.pose.position.y = y;
      truth.pose.orientation.z = std::sin(0.5 * heading);
      truth.pose.orientation.w = std::cos(0.5 * heading);
      bag.write("/ground_truth", time, truth);
    } else {
      geometry_msgs::PointStamped truth;
      truth.header.stamp = time;
      truth.header.frame_id = "map";
      truth.point.x = x;
      truth.point.y = y;
      bag.write("/ground_truth", time, truth);
    }
    const double antenna_x = x + std::cos(heading) * kAntenna[0] - std::sin(heading) * kAntenna[1];
    const double antenna_y = y + std::sin(heading) * kAntenna[0] + std::cos(heading) * kAntenna[1];
    for (const auto& [id, place] : kBeacons) {
      const double dz = place[2] - kAntenna[2];
      const double distance = std::sqrt(std::pow(place[0] - antenna_x, 2) +
                                        std::pow(place[1] - antenna_y, 2) + dz * dz);
      BeaconRange range;
      range.header.stamp = time;
      range.header.frame_id = "antenna";
      range.beacon = id;
      range.range = kCalibrations.at(id).scale * distance + kCalibrations.at(id).bias;
      if (options.with_outliers && i % 5 == 0) range.range += 4.0;
      bag.write("/ranges", time, range);
    }
    BeaconRange stranger;
    stranger.header.stamp = time;
    stranger.header.frame_id = "antenna";
    stranger.beacon = 77;
    stranger.range = 5.0;
    if (i < 3) bag.write("/ranges", time, stranger);
  }
  bag.finish();
}

class CalibrateRanges : public ::testing::Test {
 protected:
  std::string bag_with(const BagOptions& options) const {
    write_bag(directory_.file("run.bag"), options);
    return directory_.file("run.bag");
  }
  // Calibration by beacon, from the YAML file.
  std::map<int, YAML::Node> calibrate(const std::string& arguments) const {
    const std::string file = directory_.file("calibration.yaml");
    const ProgramResult result = run_program("calibrate_ranges " + arguments + " --output " + file);
    EXPECT_EQ(result.exit_code, 0) << result.error;
    EXPECT_EQ(result.error, "");
    std::map<int, YAML::Node> entries;
    for (const YAML::Node& entry : YAML::Load(read_file(file))["calibration"]) {
      entries[entry["beacon"].as<int>()] = entry;
    }
    return entries;
  }
  void expect_calibrations(std::map<int, YAML::Node> entries, double tolerance) const {
    EXPECT_EQ(entries.size(), 3u);
    for (const auto& [id, calibration] : kCalibrations) {
      EXPECT_NEAR(entries[id]["scale"].as<double>(), calibration.scale, tolerance) << id;
      EXPECT_NEAR(entries[id]["bias"].as<double>(), calibration.bias, 10.0 * tolerance) << id;
      EXPECT_NEAR(entries[id]["sigma"].as<double>(), 0.0, 10.0 * tolerance) << id;
    }
  }
  TemporaryDirectory directory_;
};

TEST_F(CalibrateRanges, FindsScaleAndBiasOfEachBeacon) {
  expect_calibrations(calibrate(bag_with({})), 1e-5);
}

TEST_F(CalibrateRanges, LeavesOutliersOut) {
  BagOptions options;
  options.with_outliers = true;
  const std::string bag = bag_with(options);
  expect_calibrations(calibrate(bag), 1e-5);
  // 80 of 400 of each beacon.
  EXPECT_TRUE(says(run_program("calibrate_ranges " + bag).out, "80"));
}

TEST_F(CalibrateRanges, TakesTheDirectionOfTravelWithoutHeading) {
  BagOptions options;
  options.with_heading = false;
  const std::string bag = bag_with(options);
  // Direction to 0.02 rad inside, 0.1 rad at the ends: millimetres of 0.5 m.
  expect_calibrations(calibrate(bag), 1e-3);
  EXPECT_TRUE(says(run_program("calibrate_ranges " + bag).out, "direction of travel"));
}

TEST_F(CalibrateRanges, ThePlaceOfTheAntennaCanBeGiven) {
  BagOptions options;
  options.with_frames = false;
  const std::string bag = bag_with(options);
  expect_calibrations(calibrate(bag + " --antenna 0.4,-0.3,0.8"), 1e-5);
  const ProgramResult result = run_program("calibrate_ranges " + bag);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_TRUE(result.is_one_line_error("calibrate_ranges")) << result.error;
  EXPECT_TRUE(says(result.error, "'antenna'"));
}

TEST_F(CalibrateRanges, PrintsATableAndWhatItLeftOut) {
  const std::string out = run_program("calibrate_ranges " + bag_with({})).out;
  EXPECT_TRUE(says(out, "1.0500 ± 0.0000"));
  EXPECT_TRUE(says(out, "3 ranges not used: of beacons without a position"));
  EXPECT_TRUE(says(out, "calibration:\n  - {beacon: -1, "));
}

TEST_F(CalibrateRanges, CanWriteOneForAll) {
  const auto entries = calibrate(bag_with({}) + " --shared");
  EXPECT_EQ(entries.size(), 1u);
  EXPECT_EQ(entries.count(-1), 1u);
}

TEST_F(CalibrateRanges, RefusesBadInputInOneLine) {
  BagOptions options;
  options.with_beacons = false;
  const std::string bag = bag_with(options);
  ProgramResult result = run_program("calibrate_ranges " + bag);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_TRUE(result.is_one_line_error("calibrate_ranges")) << result.error;
  EXPECT_TRUE(says(result.error, "no /beacons"));
  EXPECT_TRUE(says(result.error, "/ranges (pf_resampling/BeaconRange)"));
  const std::string text = directory_.write("text.bag", "not a bag\n");
  for (const std::string& arguments :
       {directory_.file("missing.bag"), text, bag_with({}) + " --outliers 0",
        bag_with({}) + " --ranges /distances"}) {
    result = run_program("calibrate_ranges " + arguments);
    EXPECT_EQ(result.exit_code, 1) << arguments;
    EXPECT_TRUE(result.is_one_line_error("calibrate_ranges")) << arguments << "\n" << result.error;
  }
  for (const std::string& arguments : {std::string(), bag + " --antenna 1,2", bag + " --shard"}) {
    result = run_program("calibrate_ranges " + arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments;
    EXPECT_TRUE(result.is_one_line_error("calibrate_ranges")) << arguments << "\n" << result.error;
  }
}

}  // namespace
}  // namespace pf_resampling
