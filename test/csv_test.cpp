#include "tools/datasets/csv.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "test/temporary_directory.hpp"

namespace pf_resampling {
namespace {

TEST(ReadCsv, ReadsEveryFile) {
  const TemporaryDirectory directory;
  directory.write("odometry.csv", "t,x,y,heading\n1,5,6,0\n2,6,6,0.5\n");
  directory.write("ranges.csv", "t,beacon,range,variance\n1.5,7,3.25,0.04\n1.75,-1,4,0\n");
  directory.write("beacons.csv", "beacon,x,y,z\n7,1,2,3\n8,4,5,6\n");
  directory.write("landmark_observations.csv",
                  "t,id,range,bearing,range_variance,bearing_variance\n1.5,-1,2,0.5,0.01,0.02\n");
  directory.write("landmarks.csv", "id,x,y\n3,4,5\n");
  directory.write("ground_truth.csv", "t,x,y,heading\n1,10,20,3.5\n");
  directory.write("frames.csv", "frame,x,y,z,yaw\nantenna,0.1,0.2,0.3,0\nsensor,1,2,3,0.5\n");
  const Recording recording = read_csv(directory.path(), 1.0);

  ASSERT_EQ(recording.odometry.size(), 2U);
  EXPECT_EQ(recording.odometry[0].pose.x, 0.0);  // begins at the origin
  EXPECT_EQ(recording.odometry[1].pose.x, 1.0);
  EXPECT_EQ(recording.odometry[1].pose.heading, 0.5);
  ASSERT_EQ(recording.ranges.size(), 2U);
  EXPECT_EQ(recording.ranges[0].time, 1.5);
  EXPECT_EQ(recording.ranges[0].beacon, 7);
  EXPECT_EQ(recording.ranges[0].range, 3.25);
  EXPECT_EQ(recording.ranges[0].variance, 0.04);
  EXPECT_EQ(recording.ranges[0].frame, "antenna");
  EXPECT_EQ(recording.ranges[1].beacon, -1);
  ASSERT_EQ(recording.beacons.size(), 2U);
  EXPECT_EQ(recording.beacons[1].z, 6.0);
  ASSERT_EQ(recording.landmark_observations.size(), 1U);
  EXPECT_EQ(recording.landmark_observations[0].id, -1);
  EXPECT_EQ(recording.landmark_observations[0].bearing_variance, 0.02);
  ASSERT_EQ(recording.landmarks.size(), 1U);
  EXPECT_EQ(recording.landmarks[0].y, 5.0);
  ASSERT_EQ(recording.truth.size(), 1U);
  EXPECT_TRUE(recording.truth_has_heading);
  EXPECT_NEAR(recording.truth[0].pose.heading, 3.5 - 2.0 * kPi, 1e-12);
  ASSERT_EQ(recording.frames.size(), 2U);
  EXPECT_EQ(recording.frames[1].name, "sensor");
  EXPECT_EQ(recording.frames[1].yaw, 0.5);
}

TEST(ReadCsv, PassesOverWhatPeopleAndProgramsPutIntoCsvFiles) {
  const TemporaryDirectory directory;
  // A byte order mark, comments, blank lines, another order of columns, capitals, quotes, spaces,
  // CR LF, a column of no interest, no end of line at the end.
  directory.write("ranges.csv",
                  "\xEF\xBB\xBF# recorded in the hall\r\n\r\n \"Range\", snr , T ,beacon\r\n"
                  "3.25, 9,\t1.5 ,7 # first\r\n,\r\n"
                  "#3,4,5,6\r\n  4.5,9,2,\"8\"");
  // The line with only a comma is a row of two empty fields: an error.
  EXPECT_THROW(read_csv(directory.path(), 1.0), Error);
  directory.write("ranges.csv",
                  "\xEF\xBB\xBF# recorded in the hall\r\n\r\n \"Range\", snr , T ,beacon\r\n"
                  "3.25, 9,\t1.5 ,7 # first\r\n   \r\n"
                  "#3,4,5,6\r\n  4.5,9,2,\"8\"");
  const Recording recording = read_csv(directory.path(), 1.0);
  ASSERT_EQ(recording.ranges.size(), 2U);
  EXPECT_EQ(recording.ranges[0].time, 1.5);
  EXPECT_EQ(recording.ranges[1].beacon, 8);
  EXPECT_EQ(recording.ranges[1].range, 4.5);
  ASSERT_EQ(recording.notes.size(), 1U);
  EXPECT_EQ(recording.notes[0], "ranges.csv: column 'snr' is not used");
}

TEST(ReadCsv, FeetBecomeMetresAndTheirVarianceToo) {
  const TemporaryDirectory directory;
  directory.write("ranges.csv", "t,beacon,range,variance\n1,1,10,4\n");
  directory.write("landmark_observations.csv",
                  "t,id,range,bearing,range_variance,bearing_variance\n1,1,10,0.5,4,0.1\n");
  const Recording recording = read_csv(directory.path(), kMetresPerFoot);
  EXPECT_DOUBLE_EQ(recording.landmark_observations[0].range, 3.048);
  EXPECT_DOUBLE_EQ(recording.landmark_observations[0].range_variance, 4.0 * 0.3048 * 0.3048);
  EXPECT_DOUBLE_EQ(recording.landmark_observations[0].bearing, 0.5);
  EXPECT_DOUBLE_EQ(recording.landmark_observations[0].bearing_variance, 0.1);
  EXPECT_DOUBLE_EQ(recording.ranges[0].range, 3.048);
  EXPECT_DOUBLE_EQ(recording.ranges[0].variance, 4.0 * 0.3048 * 0.3048);
}

TEST(ReadCsv, StepsBeginOneIntervalBeforeTheFirstRow) {
  const TemporaryDirectory directory;
  // A quarter circle of radius 1 in 90 steps of one degree: chords of 2 sin(0.5 deg).
  std::string text = "t,distance,dheading\n";
  const double degree = kPi / 180.0;
  for (int i = 1; i <= 90; ++i) {
    text += std::to_string(10.0 + 0.5 * i) + "," + std::to_string(2.0 * std::sin(0.5 * degree)) +
            "," + std::to_string(degree) + "\n";
  }
  directory.write("odometry.csv", text);
  const Recording recording = read_csv(directory.path(), 1.0);
  ASSERT_EQ(recording.odometry.size(), 91U);
  EXPECT_NEAR(recording.odometry[0].time, 10.0, 1e-9);
  const Pose2& last = recording.odometry.back().pose;
  EXPECT_NEAR(last.x, 1.0, 1e-4);  // the numbers in the file have six digits
  EXPECT_NEAR(last.y, 1.0, 1e-4);
  EXPECT_NEAR(last.heading, 0.5 * kPi, 1e-4);
}

TEST(ReadCsv, VelocitiesHoldUntilTheNextRow) {
  const TemporaryDirectory directory;
  directory.write("odometry.csv", "t,v,omega\n1,2,0\n2,1,0.2\n2.5,100,100\n");
  const Recording recording = read_csv(directory.path(), 1.0);
  ASSERT_EQ(recording.odometry.size(), 3U);
  EXPECT_EQ(recording.odometry[0].pose.x, 0.0);
  EXPECT_EQ(recording.odometry[1].pose.x, 2.0);
  EXPECT_EQ(recording.odometry[1].pose.heading, 0.0);
  EXPECT_NEAR(recording.odometry[2].pose.x, 2.0 + 0.5 * std::cos(0.05), 1e-12);
  EXPECT_NEAR(recording.odometry[2].pose.y, 0.5 * std::sin(0.05), 1e-12);
  EXPECT_NEAR(recording.odometry[2].pose.heading, 0.1, 1e-12);
}

TEST(ReadCsv, OdometryOfEqualTimesIsMerged) {
  const TemporaryDirectory directory;
  directory.write("odometry.csv", "t,distance,dheading\n1,1,0\n2,1,0\n2,1,0\n3,1,0\n");
  const Recording recording = read_csv(directory.path(), 1.0);
  ASSERT_EQ(recording.odometry.size(), 4U);
  EXPECT_EQ(recording.odometry[2].pose.x, 3.0);
  EXPECT_EQ(recording.notes.size(), 1U);
}

TEST(ReadCsv, RangesThatLookLikeFeetAreRemarkedOn) {
  const TemporaryDirectory directory;
  std::string ranges = "t,beacon,range\n";
  for (int i = 0; i < 20; ++i) ranges += std::to_string(i) + ",1,16.4\n";  // 5 m in feet
  directory.write("ranges.csv", ranges);
  directory.write("beacons.csv", "beacon,x,y\n1,3,4\n");
  directory.write("ground_truth.csv", "t,x,y\n0,0,0\n20,0,0\n");
  const Recording recording = read_csv(directory.path(), 1.0);
  ASSERT_EQ(recording.notes.size(), 1U);
  EXPECT_NE(recording.notes[0].find("--range-unit ft"), std::string::npos);
  EXPECT_TRUE(read_csv(directory.path(), kMetresPerFoot).notes.empty());
}

std::string error_of(const std::string& directory) {
  try {
    read_csv(directory, 1.0);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(ReadCsv, PutsRowsInOrderOfTimeAndSaysSo) {
  const TemporaryDirectory directory;
  directory.write("odometry.csv", "t,v,omega\n2,1,0\n1,2,0\n4,0,0\n");
  directory.write("ranges.csv", "t,beacon,range\n3,1,9\n2,1,8\n3,2,7\n2,2,6\n");
  const Recording recording = read_csv(directory.path(), 1.0);
  ASSERT_EQ(recording.odometry.size(), 3U);
  EXPECT_EQ(recording.odometry[1].time, 2.0);
  EXPECT_EQ(recording.odometry[1].pose.x, 2.0);  // 2 m/s for 1 s
  EXPECT_EQ(recording.odometry[2].pose.x, 4.0);  // then 1 m/s for 2 s
  std::vector<double> ranges;
  for (const auto& range : recording.ranges) ranges.push_back(range.range);
  EXPECT_EQ(ranges, (std::vector<double>{8, 6, 9, 7}));  // of equal times as they were
  EXPECT_EQ(recording.notes, (std::vector<std::string>{"odometry.csv: rows put in order of time",
                                                       "ranges.csv: rows put in order of time"}));
}

TEST(ReadCsv, SaysWhenAnglesLookLikeDegrees) {
  const auto notes_of = [](const std::string& file, const std::string& contents) -> std::string {
    const TemporaryDirectory directory;
    directory.write(file, contents);
    const auto notes = read_csv(directory.path(), 1.0).notes;
    return notes.empty() ? "" : notes.front();
  };
  const std::string end = "); angles have to be in radians";
  EXPECT_EQ(notes_of("odometry.csv", "t,x,y,heading\n1,0,0,90\n2,0,1,91\n"),
            "odometry.csv: column 'heading' looks like degrees (it goes to 91.0" + end);
  EXPECT_EQ(notes_of("odometry.csv", "t,x,y,heading\n1,0,0,-1\n2,0,1,359\n"),
            "odometry.csv: column 'heading' looks like degrees (it goes to 359.0" + end);
  EXPECT_EQ(notes_of("ground_truth.csv", "t,x,y,heading\n1,0,0,0\n2,0,1,90\n"),
            "ground_truth.csv: column 'heading' looks like degrees (it goes to 90.0" + end);
  EXPECT_EQ(notes_of("odometry.csv", "t,v,omega\n1,1,-20\n2,1,0\n"),
            "odometry.csv: column 'omega' looks like degrees (it goes to 20.0" + end);
  EXPECT_EQ(notes_of("odometry.csv", "t,distance,dheading\n1,1,10\n2,1,0\n"),
            "odometry.csv: column 'dheading' looks like degrees (it goes to 10.0" + end);
  // A heading that counts turns on, in radians.
  EXPECT_EQ(notes_of("odometry.csv", "t,x,y,heading\n1,0,0,3\n2,0,1,6\n3,1,0,9\n4,1,1,12\n"), "");
}

TEST(ReadCsv, SaysWhichDirectoryIsOfNoUse) {
  const TemporaryDirectory directory;
  EXPECT_EQ(error_of(directory.file("none")), directory.file("none") + ": no such directory");
  EXPECT_NE(error_of(directory.path()).find("has none of odometry.csv, ranges.csv"),
            std::string::npos);
  const std::string file = directory.write("ranges.csv", "t,beacon,range\n");
  EXPECT_NE(error_of(file).find("is a file"), std::string::npos);
}

TEST(ReadCsv, TablesWithoutEndAreRefusedAtOnce) {
  const TemporaryDirectory directory;
  std::string names = "t,beacon,range";
  for (int i = 3; i < 1000; ++i) names += ",c" + std::to_string(i);
  std::string path =
      directory.write("ranges.csv", names + "\n1,2,3" + std::string(997, ',') + "\n");
  EXPECT_EQ(error_of(directory.path()), "");
  directory.write("ranges.csv", names + ",more\n");
  EXPECT_EQ(error_of(directory.path()),
            path + ":1: 1001 columns, more than 1000; is it the right file?");
  directory.write("ranges.csv", "t,beacon,range\n1,2,3\n" + std::string(10000000, ','));
  EXPECT_EQ(error_of(directory.path()),
            path + ":3: 10000001 fields, where the header names 3 columns");
  std::filesystem::remove(path);
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  EXPECT_EQ(error_of(directory.path()),
            path + ": is a pipe or a device, not a file; copy it into a file");
}

struct BadFile {
  const char* name;
  const char* contents;
  const char* error;  // after the file's path
};

class MalformedCsv : public testing::TestWithParam<BadFile> {};

TEST_P(MalformedCsv, IsToldByFileLineColumnAndValue) {
  const TemporaryDirectory directory;
  const std::string path = directory.write(GetParam().name, GetParam().contents);
  EXPECT_EQ(error_of(directory.path()), path + GetParam().error);
}

INSTANTIATE_TEST_SUITE_P(
    EachKind, MalformedCsv,
    testing::Values(
        BadFile{"ranges.csv", "", ": is empty; its first line has to name the columns"},
        BadFile{"ranges.csv", "1.0,7,3.5\n",
                ":1: '1.0' where the name of a column is expected; the first line has to name the "
                "columns"},
        BadFile{"ranges.csv", "# a comment\n\nt,beacon\n1,2\n",
                ":3: column range is missing; the columns are t,beacon,range,[variance]"},
        BadFile{"ranges.csv", "t,beacon,range,t\n", ":1: column t is named twice"},
        BadFile{"ranges.csv", "t;beacon;range\n",
                ":1: 't;beacon;range': columns have to be separated by commas"},
        BadFile{"ranges.csv", "t,beacon,range\n1,2,3\n1,2\n",
                ":3: 2 fields, where the header names 3 columns"},
        BadFile{"ranges.csv", "t,beacon,range\n1,2,3,\n",
                ":2: 4 fields, where the header names 3 columns"},
        BadFile{"ranges.csv", "t,beacon,range\n# c\n1,2,abc\n",
                ":3: column range: 'abc' is not a number"},
        BadFile{"ranges.csv", "t,beacon,range\n1,2,3.5m\n",
                ":2: column range: '3.5m' is not a number"},
        BadFile{"ranges.csv", "t,beacon,range\n1,2,\n", ":2: column range: '' is empty"},
        BadFile{"ranges.csv", "t,beacon,range\n1,2,nan\n", ":2: column range: 'nan' is not finite"},
        BadFile{"ranges.csv", "t,beacon,range\n1,2,inf\n", ":2: column range: 'inf' is not finite"},
        BadFile{"ranges.csv", "t,beacon,range\n1,2,1e999\n",
                ":2: column range: '1e999' is not finite"},
        BadFile{"ranges.csv", "t,beacon,range\n1,2,-3\n", ":2: column range: '-3' is negative"},
        BadFile{"ranges.csv", "t,beacon,range,variance\n1,2,3,-0.1\n",
                ":2: column variance: '-0.1' is negative"},
        BadFile{"ranges.csv", "t,beacon,range\n1,2.5,3\n",
                ":2: column beacon: '2.5' is not a whole number"},
        BadFile{"ranges.csv", "t,beacon,range\n1,3000000000,3\n",
                ":2: column beacon: '3000000000' is not a whole number"},
        BadFile{"ranges.csv", "t,beacon,range\n1,-2,3\n",
                ":2: column beacon: '-2' is less than -1"},
        BadFile{"ranges.csv", "t,beacon,range\n-1e308,2,3\n1.5,2,3\n",
                ":2: column t: '-1e308' is beyond what ROS can hold; times are in seconds"},
        BadFile{"ranges.csv", "t,beacon,range\n1.5,2,3\n1.6e18,2,3\n",
                ":3: column t: '1.6e18' is beyond what ROS can hold; times are in seconds"},
        BadFile{"beacons.csv", "beacon,x,y\n1,2,3\n1,4,5\n",
                ":3: column beacon: '1' is there twice"},
        BadFile{"beacons.csv", "beacon,x,y\n-1,2,3\n", ":2: column beacon: '-1' is less than 0"},
        BadFile{"landmarks.csv", "id,x,y\n1,2,3\n1,4,5\n", ":3: column id: '1' is there twice"},
        BadFile{"landmark_observations.csv", "t,id,range,bearing\n1,2,3,45\n",
                ":2: column bearing: '45' is more than a full turn; bearings are in radians"},
        BadFile{"landmark_observations.csv", "t,id,range,bearing\n1,-2,3,0\n",
                ":2: column id: '-2' is less than -1"},
        BadFile{"odometry.csv", "t,a,b\n",
                ": columns t,a,b; odometry has t,x,y,heading or t,distance,dheading or t,v,omega"},
        BadFile{"odometry.csv", "x,y,heading\n1,2,3\n",
                ":1: column t is missing; the columns are t,x,y,heading"},
        BadFile{"odometry.csv", "t,v,omega\n1,0,0\n2,0,x\n",
                ":3: column omega: 'x' is not a number"},
        BadFile{"odometry.csv", "t,v,omega\n1,1e308,0\n101,0,0\n",
                ":2: column v: '1e308' takes the robot beyond 1e9 m"},
        BadFile{"odometry.csv", "t,v,omega\n1,1,1e308\n101,0,0\n",
                ":2: column v: '1' takes the robot beyond 1e9 m"},
        BadFile{"odometry.csv", "t,distance,dheading\n1,1,0\n2,-2e9,0\n",
                ":3: column distance: '-2e9' takes the robot beyond 1e9 m"},
        BadFile{"odometry.csv", "t,x,y,heading\n1,1,0,0\n2,-2e9,0,0\n",
                ":3: column x: '-2e9' takes the robot beyond 1e9 m"},
        BadFile{"ground_truth.csv", "t,x,y\n1,2,nan\n", ":2: column y: 'nan' is not finite"},
        BadFile{"frames.csv", "frame,x,y\nwheel,0,0\n",
                ":2: column frame: 'wheel' is not known; frames are antenna and sensor"},
        BadFile{"frames.csv", "frame,x,y\nsensor,0,0\nsensor,0,0\n",
                ":3: column frame: 'sensor' is there twice"}));

}  // namespace
}  // namespace pf_resampling
