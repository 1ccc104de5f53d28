#include "tools/datasets/labyrinth.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <complex>
#include <filesystem>
#include <numeric>
#include <string>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "test/temporary_directory.hpp"

namespace pf_resampling {
namespace {

const std::string kLabyrinth = std::string(PF_RESAMPLING_DATASETS) + "/labyrinth_uwb";

TEST(ReadLabyrinth, ReadsTheRecording) {
  if (!std::filesystem::exists(kLabyrinth)) {
    GTEST_SKIP() << "the data set is not there: " << kLabyrinth;
  }
  const Recording recording = read_labyrinth(kLabyrinth);
  // Counts and the first line, from the files themselves.
  EXPECT_EQ(recording.odometry.size(), 233U);
  ASSERT_EQ(recording.ranges.size(), 233U);
  EXPECT_EQ(recording.truth.size(), 233U);
  EXPECT_FALSE(recording.truth_has_heading);
  EXPECT_EQ(recording.ranges[0].beacon, 105);
  EXPECT_DOUBLE_EQ(recording.ranges[0].time, 0.127943992614746);
  EXPECT_DOUBLE_EQ(recording.ranges[0].range, 2.95522014829822);
  EXPECT_DOUBLE_EQ(recording.ranges[0].variance, 0.01);
  ASSERT_EQ(recording.beacons.size(), 4U);
  EXPECT_EQ(recording.beacons[2].id, 108);
  EXPECT_EQ(recording.beacons[2].x, 2.385);
  EXPECT_EQ(recording.beacons[2].y, 2.36);
}

TEST(ReadLabyrinth, DeadReckoningHasTheShapeOfTheTruth) {
  if (!std::filesystem::exists(kLabyrinth)) {
    GTEST_SKIP() << "the data set is not there: " << kLabyrinth;
  }
  // With wheels the other way round, or their distance taken as written, the path does not fit the
  // truth to better than half a metre, however it is laid.
  const Recording recording = read_labyrinth(kLabyrinth);
  ASSERT_EQ(recording.odometry.size(), recording.truth.size());
  // The best rigid fit in the plane, as complex numbers: a turn by the phase of the correlation.
  using Point = std::complex<double>;
  std::vector<Point> path;
  std::vector<Point> truth;
  for (std::size_t i = 0; i < recording.truth.size(); ++i) {
    path.emplace_back(recording.odometry[i].pose.x, recording.odometry[i].pose.y);
    truth.emplace_back(recording.truth[i].pose.x, recording.truth[i].pose.y);
  }
  const auto count = static_cast<double>(path.size());
  const Point path_mean = std::accumulate(path.begin(), path.end(), Point()) / count;
  const Point truth_mean = std::accumulate(truth.begin(), truth.end(), Point()) / count;
  Point correlation;
  for (std::size_t i = 0; i < path.size(); ++i) {
    correlation += std::conj(path[i] - path_mean) * (truth[i] - truth_mean);
  }
  const Point turn = correlation / std::abs(correlation);
  double squares = 0.0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    squares += std::norm(turn * (path[i] - path_mean) - (truth[i] - truth_mean));
  }
  EXPECT_LT(std::sqrt(squares / count), 0.1);
}

TEST(ReadLabyrinth, TheLeftWheelComesFirstAndHalfTheDistance) {
  const TemporaryDirectory directory;
  // Left 1 m/s, right 2 m/s, half the distance 0.5 m: turns left by 1 rad/s at 1.5 m/s for 0.1 s,
  // sliding 0.2 m/s to the left.
  directory.write("A_Input.txt",
                  "odom2diff 1.0 1 2 0.2 0.5 0 0 0\n"
                  "unknown 1.05 3\n"
                  "odom2diff 1.1 0 0 0 0.5 0 0 0\n");
  const Recording recording = read_labyrinth(directory.path());
  ASSERT_EQ(recording.odometry.size(), 2U);
  EXPECT_NEAR(recording.odometry[1].pose.heading, 0.1, 1e-12);
  EXPECT_NEAR(recording.odometry[1].pose.x, 0.15 * std::cos(0.05) - 0.02 * std::sin(0.05), 1e-12);
  EXPECT_NEAR(recording.odometry[1].pose.y, 0.15 * std::sin(0.05) + 0.02 * std::cos(0.05), 1e-12);
  ASSERT_EQ(recording.notes.size(), 1U);
  EXPECT_EQ(recording.notes[0], "1 lines unknown are not used");
}

std::string error_of(const std::string& directory) {
  try {
    read_labyrinth(directory);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(ReadLabyrinth, SaysWhatIsWrongAndWhere) {
  const TemporaryDirectory directory;
  EXPECT_EQ(error_of(directory.file("none")), directory.file("none") + ": no such directory");
  EXPECT_EQ(error_of(directory.path()), directory.path() + ": has no file *Input.txt");
  const std::string path = directory.file("A_Input.txt");
  const auto error_with = [&](const std::string& contents) {
    directory.write("A_Input.txt", contents);
    return error_of(directory.path());
  };
  EXPECT_EQ(error_with("range2 1 2 0.01 0 0 7 0\nrange2 1 x 0.01 0 0 7 0\n"),
            path + ":2: range2: 'x' is not a finite number");
  EXPECT_EQ(error_with("range2 1 2 0.01\n"), path + ":1: range2 with 3 numbers, 6 are needed");
  EXPECT_EQ(error_with("range2 1 -2 0.01 0 0 7 0\n"), path + ":1: negative range");
  EXPECT_EQ(error_with("range2 1 2 -0.01 0 0 7 0\n"), path + ":1: negative variance");
  EXPECT_NE(error_with("range2 2 2 0.01 0 0 7 0\nrange2 1 2 0.01 0 0 7 0\n").find(path + ":2: "),
            std::string::npos);
  EXPECT_NE(error_with("range2 1 2 0.01 0 0 7 0\nrange2 2 2 0.01 5 0 7 0\n").find("beacon 7"),
            std::string::npos);
  for (const char* id : {"1e30", "-5e30", "4294967297", "-2147483649", "7.5"}) {
    const std::string said = error_with("range2 1 2 0.01 0 0 " + std::string(id) + " 0\n");
    EXPECT_EQ(said.rfind(path + ":1: range2: the id ", 0), 0U) << said;
    EXPECT_NE(said.find("is not a whole number of 32 bits"), std::string::npos) << said;
  }
  EXPECT_EQ(error_with("range2 1 2 0.01 0 0 2147483647 0\nrange2 1 2 0.01 0 0 -2147483648 0\n"),
            "");
  EXPECT_NE(error_with("something else\n").find("no line range2"), std::string::npos);
  std::filesystem::remove(path);
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  EXPECT_EQ(error_of(directory.path()),
            path + ": is a pipe or a device, not a file; copy it into a file");
}

}  // namespace
}  // namespace pf_resampling
