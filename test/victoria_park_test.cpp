#include "tools/datasets/victoria_park.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/evaluation/statistics.hpp"
#include "test/mat_file_writer.hpp"
#include "test/temporary_directory.hpp"

namespace pf_resampling {
namespace {

const std::string kVictoriaPark = std::string(PF_RESAMPLING_DATASETS) + "/victoria_park";

/// Two scans, and controls of a constant left turn.
void write_small_set(const TemporaryDirectory& directory, double steering, int controls) {
  std::string time, speed, angle;
  for (int i = 0; i < controls; ++i) {
    time += std::to_string(1000 + 25 * i) + "\n";
    speed += "2.0\n";
    angle += std::to_string(steering) + "\n";
  }
  directory.write("time.txt", time);
  directory.write("speed.txt", speed);
  directory.write("steering.txt", angle);
  directory.write("lasersampling.txt", "1.1e+003\n1.3e+003\n");
  directory.write("ObservationDistance.txt", "  10 5 0 0\n  20 0 0 0\n");
  directory.write("ObservationAngle.txt", "  0 1.57079633 2.7e-8 2.7e-8\n 3.14159265 0 0 0\n");
}

TEST(ReadVictoriaPark, DrivesTheCircleOfItsWheels) {
  const TemporaryDirectory directory;
  write_small_set(directory, 0.3, 401);
  const Recording recording = read_victoria_park(directory.path());
  ASSERT_EQ(recording.odometry.size(), 401u);
  EXPECT_NEAR(recording.odometry[0].time, 1.0, 1e-12);
  // Turning left about a point at R = L / tan(steering) to the left of the rear axle's middle, the
  // left rear wheel is on the circle of radius R - H.
  const double radius = 2.83 / std::tan(0.3);
  const double yaw_rate = 2.0 / (radius - 0.76);
  for (const auto& now : recording.odometry) {
    const double turned = yaw_rate * (now.time - 1.0);
    // The chord of a step is taken as long as its arc: (turn of a step)^2 / 24 of the radius.
    EXPECT_NEAR(now.pose.x, radius * std::sin(turned), 1e-4);
    EXPECT_NEAR(now.pose.y, radius * (1.0 - std::cos(turned)), 1e-4);
    EXPECT_NEAR(wrap_angle(now.pose.heading - turned), 0.0, 1e-9);
  }
}

TEST(ReadVictoriaPark, AnglesAreFromTheRightAndZerosArePadding) {
  const TemporaryDirectory directory;
  write_small_set(directory, 0.0, 3);
  const Recording recording = read_victoria_park(directory.path());
  ASSERT_EQ(recording.landmark_observations.size(), 3u);
  EXPECT_NEAR(recording.landmark_observations[0].bearing, -0.5 * kPi, 1e-6);
  EXPECT_NEAR(recording.landmark_observations[1].bearing, 0.0, 1e-6);
  EXPECT_NEAR(recording.landmark_observations[2].bearing, 0.5 * kPi, 1e-6);
  EXPECT_EQ(recording.landmark_observations[1].range, 5.0);
  EXPECT_EQ(recording.landmark_observations[1].id, -1);
  EXPECT_NEAR(recording.landmark_observations[1].time, 1.1, 1e-12);
  EXPECT_NEAR(recording.landmark_observations[2].time, 1.3, 1e-12);
  ASSERT_EQ(recording.frames.size(), 2u);
  EXPECT_NEAR(recording.frames[0].x, 3.78, 1e-12);
  EXPECT_NEAR(recording.frames[0].y, 0.5, 1e-12);
  EXPECT_EQ(recording.frames[1].name, "ground_truth");
  EXPECT_NEAR(recording.frames[1].x, 3.78, 1e-12);
  EXPECT_TRUE(recording.truth.empty());
}

TEST(ReadVictoriaPark, TakesControlsAndGpsFromMatlabFiles) {
  const TemporaryDirectory directory;
  write_small_set(directory, 0.0, 3);
  for (const char* name : {"time.txt", "speed.txt", "steering.txt"}) {
    std::filesystem::remove(directory.file(name));
  }
  MatFileWriter controls;
  controls.add("time", {{2000.0}, {2500.0}}).add("speed", {{4.0}, {4.0}});
  controls.add("steering", {{0.0}, {0.0}});
  directory.write("aa3_dr.mat", controls.bytes());
  MatFileWriter gps;
  gps.add("timeGps", {{2100.0}}).add("Lo_m", {{-60.0}}).add("La_m", {{-40.0}});
  directory.write("aa3_gpsx.mat", gps.bytes());
  const Recording recording = read_victoria_park(directory.path());
  ASSERT_EQ(recording.odometry.size(), 2u);
  EXPECT_NEAR(recording.odometry[1].pose.x, 2.0, 1e-12);
  ASSERT_EQ(recording.truth.size(), 1u);
  EXPECT_NEAR(recording.truth[0].time, 2.1, 1e-12);
  EXPECT_EQ(recording.truth[0].pose.x, -60.0);
  EXPECT_EQ(recording.truth[0].pose.y, -40.0);
  EXPECT_FALSE(recording.truth_has_heading);
}

TEST(ReadVictoriaPark, ReadsTheRecording) {
  if (!std::filesystem::exists(kVictoriaPark)) {
    GTEST_SKIP() << "the data set is not there: " << kVictoriaPark;
  }
  const Recording recording = read_victoria_park(kVictoriaPark);
  // Counts and first values from the files themselves.
  EXPECT_EQ(recording.odometry.size(), 61945u);
  EXPECT_NEAR(recording.odometry[0].time, 21.94, 1e-9);
  EXPECT_EQ(recording.truth.size(), 4466u);
  EXPECT_NEAR(recording.truth[1].pose.x, -67.730985, 1e-6);
  ASSERT_FALSE(recording.landmark_observations.empty());
  EXPECT_NEAR(recording.landmark_observations[0].time, 21.819, 1e-9);
  EXPECT_NEAR(recording.landmark_observations[0].range, 20.46202, 1e-5);
  EXPECT_NEAR(recording.landmark_observations[0].bearing, 0.88575460 - 0.5 * kPi, 1e-6);
  // Lengths agree with the GPS's: chords over about 10 s, between fixes that follow each other.
  std::vector<double> ratios;
  for (std::size_t i = 0; i + 50 < recording.truth.size(); i += 10) {
    const auto& from = recording.truth[i];
    const auto& to = recording.truth[i + 50];
    const auto pose_at = [&](double time) {
      for (const auto& now : recording.odometry) {
        if (now.time >= time) return now.pose;
      }
      return recording.odometry.back().pose;
    };
    if (to.time - from.time > 15.0) continue;
    const Pose2 motion = relative(pose_at(from.time), pose_at(to.time));
    const double driven = std::hypot(to.pose.x - from.pose.x, to.pose.y - from.pose.y);
    if (driven > 10.0) ratios.push_back(std::hypot(motion.x, motion.y) / driven);
  }
  ASSERT_GT(ratios.size(), 50u);
  EXPECT_NEAR(median(ratios), 1.0, 0.05);
}

std::string error_of(const std::string& directory) {
  try {
    read_victoria_park(directory);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(ReadVictoriaPark, NamesWhatIsWrong) {
  const TemporaryDirectory directory;
  EXPECT_NE(error_of(directory.file("none")).find("no such directory"), std::string::npos);
  EXPECT_NE(error_of(directory.path()).find("has neither time.txt"), std::string::npos);
  write_small_set(directory, 0.0, 3);
  directory.write("speed.txt", "1\n2\n");
  EXPECT_NE(error_of(directory.path()).find("has 2 rows and time.txt 3"), std::string::npos);
  write_small_set(directory, 1.6, 3);
  EXPECT_NE(error_of(directory.path()).find("is not a steering angle"), std::string::npos);
  write_small_set(directory, 0.0, 3);
  directory.write("ObservationAngle.txt", "0 1 0\n3.1 0 0 0\n");
  EXPECT_NE(error_of(directory.path()).find("ObservationAngle.txt:1: 3 angles and 4 distances"),
            std::string::npos);
  write_small_set(directory, 0.0, 3);
  directory.write("time.txt", "1000\n1050\n1025\n");
  EXPECT_NE(error_of(directory.path()).find("row 3 is before"), std::string::npos);
}

}  // namespace
}  // namespace pf_resampling
