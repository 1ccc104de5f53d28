#include "tools/datasets/mrclam.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/evaluation/statistics.hpp"
#include "test/temporary_directory.hpp"

namespace pf_resampling {
namespace {

const std::string kMrclam = std::string(PF_RESAMPLING_DATASETS) + "/mrclam6";

/// A directory with one robot, two landmarks and another robot.
void write_small_set(const TemporaryDirectory& directory) {
  directory.write("Barcodes.dat", "# Subject # Barcode #\n  1  5\n  3 41\n  6 63\n  7 \t 81\r\n");
  directory.write("Robot1_Odometry.dat",
                  "# Time v w\n10.0 1.0 0.0\n12.0 0.5 0.5\n12.0 0.5 1.0\n13.0 0.0 0.0\n");
  directory.write("Robot1_Measurement.dat",
                  "10.5 63 2.0 0.1\n10.5 81 3.0 -0.1\n11.0 41 1.0 0.0\n11.5 99 1.0 0.0\n"
                  "11.0 81 4.0 0.2\n");
}

TEST(ReadMrclam, ReadsLandmarksAndLeavesRobotsAndUnknownBarcodesOut) {
  const TemporaryDirectory directory;
  write_small_set(directory);
  directory.write("Landmark_Groundtruth.dat", "6 1.0 2.0 0.1 0.2\n7 3.0 4.0 0.3 0.4\n");
  directory.write("Robot1_Groundtruth.dat", "10.0 0.5 0.25 1.5\n");
  const Recording recording = read_mrclam(directory.path(), {});
  ASSERT_EQ(recording.landmark_observations.size(), 3u);
  EXPECT_EQ(recording.landmark_observations[0].id, 6);
  EXPECT_EQ(recording.landmark_observations[1].id, 7);
  EXPECT_EQ(recording.landmark_observations[1].time, 10.5);
  EXPECT_EQ(recording.landmark_observations[1].range, 3.0);
  EXPECT_EQ(recording.landmark_observations[1].bearing, -0.1);
  EXPECT_EQ(recording.landmark_observations[1].range_variance, 0.0);
  EXPECT_EQ(recording.landmark_observations[2].time, 11.0);  // stood below a later one
  ASSERT_EQ(recording.landmarks.size(), 2u);
  EXPECT_EQ(recording.landmarks[1].id, 7);
  EXPECT_EQ(recording.landmarks[1].y, 4.0);
  EXPECT_NEAR(recording.landmarks[1].covariance[0], 0.09, 1e-12);
  EXPECT_NEAR(recording.landmarks[1].covariance[3], 0.16, 1e-12);
  ASSERT_EQ(recording.truth.size(), 1u);
  EXPECT_TRUE(recording.truth_has_heading);
  EXPECT_EQ(recording.truth[0].pose.heading, 1.5);
  ASSERT_EQ(recording.frames.size(), 1u);
  EXPECT_EQ(recording.frames[0].name, "sensor");
}

TEST(ReadMrclam, VelocitiesHoldUntilTheNextRow) {
  const TemporaryDirectory directory;
  write_small_set(directory);
  Recording recording = read_mrclam(directory.path(), {});
  ASSERT_EQ(recording.odometry.size(), 3u);
  EXPECT_EQ(recording.odometry[1].time, 12.0);
  EXPECT_NEAR(recording.odometry[1].pose.x, 2.0, 1e-12);
  EXPECT_NEAR(recording.odometry[1].pose.heading, 0.0, 1e-12);
  // Of two rows at one time the later one holds: 0.5 m on a turn of 1 rad, chord at half of it.
  EXPECT_NEAR(recording.odometry[2].pose.x, 2.0 + 0.5 * std::cos(0.5), 1e-12);
  EXPECT_NEAR(recording.odometry[2].pose.y, 0.5 * std::sin(0.5), 1e-12);
  EXPECT_NEAR(recording.odometry[2].pose.heading, 1.0, 1e-12);

  recording = read_mrclam(directory.path(), {1, 0.25});
  EXPECT_NEAR(recording.odometry[0].time, 10.25, 1e-12);
  EXPECT_EQ(recording.landmark_observations[0].time, 10.5);
}

TEST(ReadMrclam, ObservationsAreThoseOfTheTrueLandmarks) {
  if (!std::filesystem::exists(kMrclam)) {
    GTEST_SKIP() << "the data set is not there: " << kMrclam;
  }
  for (int robot = 1; robot <= 3; ++robot) {
    const Recording recording = read_mrclam(kMrclam, {robot, 0.0});
    EXPECT_EQ(recording.landmarks.size(), 15u);
    EXPECT_GT(recording.odometry.size(), 60000u);
    std::vector<double> range_errors;
    std::vector<double> bearing_errors;
    for (const auto& seen : recording.landmark_observations) {
      const auto landmark =
          std::find_if(recording.landmarks.begin(), recording.landmarks.end(),
                       [&](const Recording::Landmark& known) { return known.id == seen.id; });
      ASSERT_NE(landmark, recording.landmarks.end()) << seen.id;
      const auto truth = std::lower_bound(
          recording.truth.begin(), recording.truth.end(), seen.time,
          [](const Recording::Truth& pose, double time) { return pose.time < time; });
      if (truth == recording.truth.end()) continue;
      const Pose2 expected = relative(truth->pose, {landmark->x, landmark->y, 0.0});
      range_errors.push_back(seen.range - std::hypot(expected.x, expected.y));
      bearing_errors.push_back(wrap_angle(seen.bearing - std::atan2(expected.y, expected.x)));
    }
    ASSERT_GT(range_errors.size(), 1400u);
    // DATASETS.md: sigma 0.04 m + 3 % of ranges up to 8 m, 0.010 to 0.019 rad. Taken by the wrong
    // landmark, or on another clock, they are off by metres and tenths of radians.
    EXPECT_LT(robust_sigma(range_errors), 0.2) << "robot " << robot;
    EXPECT_LT(robust_sigma(bearing_errors), 0.04) << "robot " << robot;
  }
}

std::string error_of(const std::string& directory, int robot) {
  try {
    read_mrclam(directory, {robot, 0.0});
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(ReadMrclam, NamesFileAndLineOfWhatIsWrong) {
  const TemporaryDirectory directory;
  EXPECT_EQ(error_of(directory.file("none"), 1), directory.file("none") + ": no such directory");
  EXPECT_NE(error_of(directory.path(), 1).find("no such file; give the directory"),
            std::string::npos);
  write_small_set(directory);
  EXPECT_NE(error_of(directory.path(), 2).find("--robot has to be one of 1"), std::string::npos);
  directory.write("Robot1_Odometry.dat", "# t v w\n10.0 1.0\n");
  EXPECT_EQ(error_of(directory.path(), 1),
            directory.file("Robot1_Odometry.dat") + ":2: 2 numbers, 3 are needed");
  directory.write("Robot1_Odometry.dat", "10.0 1.0 nan\n");
  EXPECT_NE(error_of(directory.path(), 1).find(":1: 'nan' is not a finite number"),
            std::string::npos);
  write_small_set(directory);
  directory.write("Barcodes.dat", "6 63\n7 63\n");
  EXPECT_NE(error_of(directory.path(), 1).find("Barcodes.dat:2: barcode 63 is there twice"),
            std::string::npos);
  write_small_set(directory);
  directory.write("Robot1_Measurement.dat", "10.0 63.5 1.0 0.0\n");
  EXPECT_NE(error_of(directory.path(), 1).find("is not a whole number"), std::string::npos);
}

}  // namespace
}  // namespace pf_resampling
