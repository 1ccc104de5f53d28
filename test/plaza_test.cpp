#include "tools/datasets/plaza.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "test/mat_file_writer.hpp"
#include "test/temporary_directory.hpp"
#include "tools/common/files.hpp"
#include "tools/datasets/mat_file.hpp"

namespace pf_resampling {
namespace {

const std::string kPlaza2 = std::string(PF_RESAMPLING_DATASETS) + "/plaza2";

#define SKIP_WITHOUT_PLAZA2()                                 \
  if (!std::filesystem::exists(kPlaza2)) {                    \
    GTEST_SKIP() << "the data set is not there: " << kPlaza2; \
  }

/// The numbers of one of the data set's CSV files, whose header is a comment.
std::vector<std::vector<double>> numbers_of(const std::string& path) {
  std::vector<std::vector<double>> rows;
  std::istringstream lines(read_file(path));
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::vector<double> row;
    std::istringstream fields(line);
    for (std::string field; std::getline(fields, field, ',');) row.push_back(std::stod(field));
    rows.push_back(row);
  }
  return rows;
}

bool mentions(const Recording& recording, const std::string& words) {
  return std::any_of(recording.notes.begin(), recording.notes.end(), [&](const std::string& note) {
    return note.find(words) != std::string::npos;
  });
}

TEST(ReadPlaza, Plaza2IsWhatItsCsvFilesSay) {
  SKIP_WITHOUT_PLAZA2();
  const Recording recording = read_plaza(kPlaza2 + "/Plaza2.mat", {});

  // The CSV files are rounded to 1e-6 (1e-8 the headings), and their heading has been turned.
  const auto truth = numbers_of(kPlaza2 + "/plaza2_gt.csv");
  ASSERT_EQ(recording.truth.size(), truth.size());
  EXPECT_TRUE(recording.truth_has_heading);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    ASSERT_NEAR(recording.truth[i].time, truth[i][0], 1e-6);
    ASSERT_NEAR(recording.truth[i].pose.x, truth[i][1], 1e-6);
    ASSERT_NEAR(recording.truth[i].pose.y, truth[i][2], 1e-6);
    ASSERT_NEAR(wrap_angle(recording.truth[i].pose.heading - truth[i][3]), 0.0, 1e-6) << i;
  }
  EXPECT_TRUE(mentions(recording, "heading turned by pi"));

  const auto ranges = numbers_of(kPlaza2 + "/plaza2_range.csv");
  ASSERT_EQ(recording.ranges.size(), ranges.size());
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    ASSERT_NEAR(recording.ranges[i].time, ranges[i][0], 1e-6);
    ASSERT_EQ(recording.ranges[i].beacon, static_cast<int>(ranges[i][1]));
    ASSERT_NEAR(recording.ranges[i].range, ranges[i][2], 1e-6);
    ASSERT_EQ(recording.ranges[i].frame, "antenna");
    ASSERT_EQ(recording.ranges[i].variance, 0.0);
  }

  const auto beacons = numbers_of(kPlaza2 + "/plaza2_beacons.csv");
  ASSERT_EQ(recording.beacons.size(), beacons.size());
  for (std::size_t i = 0; i < beacons.size(); ++i) {
    EXPECT_EQ(recording.beacons[i].id, static_cast<int>(beacons[i][0]));
    EXPECT_NEAR(recording.beacons[i].x, beacons[i][1], 1e-6);
    EXPECT_NEAR(recording.beacons[i].y, beacons[i][2], 1e-6);
    EXPECT_FALSE(recording.beacons[i].z);
  }

  // Each step of the odometry, seen between its poses; the first pose is at the start of the truth.
  const auto steps = numbers_of(kPlaza2 + "/plaza2_odom.csv");
  ASSERT_EQ(recording.odometry.size(), steps.size() + 1);
  EXPECT_NEAR(recording.odometry[0].time, truth[0][0], 1e-6);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const auto& before = recording.odometry[i].pose;
    const auto& after = recording.odometry[i + 1].pose;
    ASSERT_NEAR(recording.odometry[i + 1].time, steps[i][0], 1e-6);
    ASSERT_NEAR(std::hypot(after.x - before.x, after.y - before.y), steps[i][1], 1e-8);
    ASSERT_NEAR(wrap_angle(after.heading - before.heading), steps[i][2], 1e-8);
  }
}

TEST(ReadPlaza, StepsAreIntegratedLikeThePathTheFilePublishes) {
  SKIP_WITHOUT_PLAZA2();
  // DRp is the authors' own path. The mid-point rule stays within 6.3 cm of it over 1354 m; with
  // the heading before or after each step it would be 44 and 55 cm.
  const Recording recording = read_plaza(kPlaza2 + "/Plaza2.mat", {});
  const auto published = MatFile(kPlaza2 + "/Plaza2.mat").matrix("DRp", 4);
  ASSERT_TRUE(published);
  ASSERT_EQ(static_cast<std::size_t>(published->rows()), recording.odometry.size());
  const Pose2 first{(*published)(0, 1), (*published)(0, 2), (*published)(0, 3)};
  double farthest = 0.0;
  for (Eigen::Index i = 0; i < published->rows(); ++i) {
    const Pose2 pose = compose(first, recording.odometry[static_cast<std::size_t>(i)].pose);
    farthest =
        std::max(farthest, std::hypot(pose.x - (*published)(i, 1), pose.y - (*published)(i, 2)));
  }
  EXPECT_LT(farthest, 0.1);
}

/// A drive of 2 s along x at 1 m/s with two beacons; ranges true but in `unit` metres. `heading`:
/// of the truth.
MatFileWriter drive(double unit, double heading) {
  std::vector<std::vector<double>> truth;
  std::vector<std::vector<double>> steps;
  std::vector<std::vector<double>> ranges;
  for (int i = 0; i <= 20; ++i) {
    const double time = 100.0 + 0.1 * i;
    const double x = 0.1 * i;
    truth.push_back({time, x, 0.0, heading});
    if (i > 0) steps.push_back({time, 0.1, 0.0});
    ranges.push_back({time, 0.0, 3.0, std::hypot(x - 5.0, 4.0) / unit});
    ranges.push_back({time, 1.0, 8.0, std::hypot(x + 2.0, 3.0) / unit});
  }
  MatFileWriter file;
  file.add("GT", truth).add("DR", steps).add("TD", ranges);
  file.add("TL", {{3.0, 5.0, 4.0}, {8.0, -2.0, -3.0}});
  return file;
}

TEST(ReadPlaza, KurthsFeetBecomeMetres) {
  const TemporaryDirectory directory;
  const std::string path = directory.write("kurth.mat", drive(0.3048, 0.0).bytes());
  PlazaOptions feet;
  feet.metres_per_unit = kMetresPerFoot;
  for (const PlazaOptions& options : {feet, PlazaOptions{}}) {  // told, and found from the truth
    const Recording recording = read_plaza(path, options);
    ASSERT_EQ(recording.ranges.size(), 42U);
    EXPECT_NEAR(recording.ranges[0].range, std::sqrt(25.0 + 16.0), 1e-12);
    EXPECT_NEAR(recording.ranges[41].range, 5.0, 1e-12);
    EXPECT_EQ(mentions(recording, "taken as feet"), !options.metres_per_unit);
  }
  PlazaOptions metres;
  metres.metres_per_unit = 1.0;
  EXPECT_NEAR(read_plaza(path, metres).ranges[41].range, 5.0 / 0.3048, 1e-12);
  EXPECT_EQ(kMetresPerFoot, 0.3048);
}

TEST(ReadPlaza, MetresStayMetresThoughRangesAreTooLong) {
  const TemporaryDirectory directory;
  const std::string path = directory.write("long.mat", drive(1.0 / 1.3, 0.0).bytes());
  EXPECT_NEAR(read_plaza(path, {}).ranges[41].range, 1.3 * 5.0, 1e-12);
}

TEST(ReadPlaza, HeadingIsTurnedOnlyIfItPointsBackwards) {
  const TemporaryDirectory directory;
  for (const double heading : {0.0, 0.3, -1.2, kPi, 2.8}) {
    const std::string path = directory.write("a.mat", drive(1.0, heading).bytes());
    const Recording recording = read_plaza(path, {});
    const bool backwards = std::abs(heading) > kPi / 2;
    EXPECT_EQ(mentions(recording, "heading turned by pi"), backwards) << heading;
    const double turned = wrap_angle(recording.truth[5].pose.heading - heading);
    EXPECT_NEAR(std::abs(turned), backwards ? kPi : 0.0, 1e-12);
    EXPECT_LT(std::abs(recording.truth[5].pose.heading), kPi / 2);
  }
}

TEST(ReadPlaza, SeveralAntennasHaveFramesOfTheirOwn) {
  const TemporaryDirectory directory;
  const std::string path = directory.write("a.mat", drive(1.0, 0.0).bytes());
  PlazaOptions options;
  options.antennas[1] = {"antenna", 0.1, 0.2, 0.3, 0.0};
  const Recording recording = read_plaza(path, options);
  EXPECT_EQ(recording.ranges[0].frame, "antenna_0");
  EXPECT_EQ(recording.ranges[1].frame, "antenna_1");
  ASSERT_EQ(recording.frames.size(), 1U);
  EXPECT_EQ(recording.frames[0].name, "antenna_1");
  EXPECT_EQ(recording.frames[0].z, 0.3);
}

TEST(ReadPlaza, DrivesWithoutTruthOrSurveyAreRead) {
  const TemporaryDirectory directory;
  MatFileWriter file;
  file.add("DR", {{1.0, 0.5, 0.0}, {1.5, 0.5, 0.1}}).add("TD", {{1.2, 2.0, 7.0, 3.0}});
  const Recording recording = read_plaza(directory.write("a.mat", file.bytes()), {});
  ASSERT_EQ(recording.odometry.size(), 3U);
  EXPECT_DOUBLE_EQ(recording.odometry[0].time, 0.5);  // one interval before the first step's end
  EXPECT_TRUE(recording.truth.empty());
  EXPECT_TRUE(mentions(recording, "metres are assumed"));
  EXPECT_TRUE(mentions(recording, "no variable TL"));
}

TEST(ReadPlaza, RowsThatAreNotFiniteAreDroppedAndTold) {
  const TemporaryDirectory directory;
  MatFileWriter file;
  file.add("DR", {{1.0, 0.5, 0.0}, {1.5, 0.5, 0.1}});
  file.add("TD", {{1.2, 2.0, 7.0, std::nan("")}, {1.3, 2.0, 7.0, -1.0}, {1.4, 2.0, 7.0, 2.0}});
  const Recording recording = read_plaza(directory.write("a.mat", file.bytes()), {});
  ASSERT_EQ(recording.ranges.size(), 1U);
  EXPECT_EQ(recording.ranges[0].range, 2.0);
  EXPECT_TRUE(mentions(recording, "1 rows that are not finite"));
  EXPECT_TRUE(mentions(recording, "1 negative"));
}

std::string error_of(const std::string& path) {
  try {
    read_plaza(path, {});
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(ReadPlaza, SaysWhatIsWrongWithAFile) {
  const TemporaryDirectory directory;
  EXPECT_EQ(error_of(directory.file("none.mat")), directory.file("none.mat") + ": no such file");
  EXPECT_EQ(error_of("/dev/zero"),
            "/dev/zero: is a pipe or a device, not a file; copy it into a file");
  const std::string text = directory.write("text.mat", "t,x,y\n1,2,3\n");
  EXPECT_EQ(error_of(text), text + ": is not a MATLAB file of versions 5 to 7 (save it with -v7)");

  MatFileWriter other;
  other.add("lm", {{1.0, 2.0}}).add("wp", {{1.0, 2.0}});
  const std::string map = directory.write("map.mat", other.bytes());
  EXPECT_NE(error_of(map).find("it has lm, wp"), std::string::npos) << error_of(map);

  MatFileWriter narrow;
  narrow.add("DR", {{1.0, 2.0}});
  const std::string path = directory.write("narrow.mat", narrow.bytes());
  EXPECT_EQ(error_of(path), path + ": variable DR has 2 columns, 3 are needed");

  const std::string whole = drive(1.0, 0.0).bytes();
  for (std::size_t length = 129; length < whole.size(); length += 40) {
    const std::string cut = directory.write("cut.mat", whole.substr(0, length));
    const std::string error = error_of(cut);
    // A file may end between two variables; then one is missing, and TL alone may be.
    EXPECT_TRUE(error == cut + ": is truncated" ||
                error.find("has no variable") != std::string::npos)
        << length << error;
  }
}

}  // namespace
}  // namespace pf_resampling
