#include <geometry_msgs/PointStamped.h>
#include <gtest/gtest.h>
#include <pf_resampling/BeaconRange.h>
#include <rosbag/view.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "test/mat_file_writer.hpp"
#include "test/run_program.hpp"
#include "test/temporary_directory.hpp"
#include "tools/common/bag.hpp"

namespace pf_resampling {
namespace {

BeaconRange first_range(const std::string& path) {
  const rosbag::Bag bag = open_bag(path);
  for (const rosbag::MessageInstance& instance : rosbag::View(bag, rosbag::TopicQuery("/ranges"))) {
    return *instance.instantiate<BeaconRange>();
  }
  throw std::runtime_error("no range");
}

TEST(DatasetToBag, MakesReadyBagsOfTheDataSets) {
  const std::string datasets = PF_RESAMPLING_DATASETS;
  if (!std::filesystem::exists(datasets)) {
    GTEST_SKIP() << "the data sets are not there: " << datasets;
  }
  const TemporaryDirectory directory;
  const std::string out = directory.file("out.bag");
  const ProgramResult plaza =
      run_program("dataset_to_bag plaza " + datasets + "/plaza2/Plaza2.mat " + out);
  EXPECT_EQ(plaza.exit_code, 0) << plaza.error;
  EXPECT_EQ(plaza.error, "");
  // Counts of DATASETS.md; a pose of the odometry more than steps.
  EXPECT_NE(plaza.out.find("4091 in 409.5 s"), std::string::npos) << plaza.out;
  EXPECT_NE(plaza.out.find("1816 in 409.4 s"), std::string::npos) << plaza.out;
  EXPECT_NE(plaza.out.find("heading turned by pi"), std::string::npos) << plaza.out;
  EXPECT_EQ(run_program("check_bag " + out).exit_code, 0);

  const ProgramResult labyrinth =
      run_program("dataset_to_bag labyrinth " + datasets + "/labyrinth_uwb " + out);
  EXPECT_EQ(labyrinth.exit_code, 0) << labyrinth.error;
  EXPECT_EQ(run_program("check_bag " + out).exit_code, 0);
  EXPECT_DOUBLE_EQ(first_range(out).variance, 0.01);
  EXPECT_EQ(directory.listing(), "out.bag");

  const ProgramResult mrclam =
      run_program("dataset_to_bag mrclam " + datasets + "/mrclam6 " + out + " --robot 3");
  EXPECT_EQ(mrclam.exit_code, 0) << mrclam.error;
  EXPECT_NE(mrclam.out.find("4348 in 886.1 s"), std::string::npos) << mrclam.out;  // DATASETS.md
  EXPECT_NE(mrclam.out.find("1277 observations of robots left out"), std::string::npos);
  const ProgramResult victoria_park =
      run_program("dataset_to_bag victoria_park " + datasets + "/victoria_park " + out);
  EXPECT_EQ(victoria_park.exit_code, 0) << victoria_park.error;
  EXPECT_NE(victoria_park.out.find("61945 in 1548.6 s"), std::string::npos) << victoria_park.out;
  const ProgramResult check = run_program("check_bag " + out);
  EXPECT_EQ(check.exit_code, 0);
  EXPECT_NE(check.out.find("\nready for fastslam: yes\n"), std::string::npos) << check.out;
  EXPECT_NE(check.out.find("\nready for beacon_mcl: no: no /ranges"), std::string::npos);
}

TEST(DatasetToBag, UnitsAndAntennasComeFromTheCommandLine) {
  const TemporaryDirectory directory;
  directory.write("odometry.csv", "t,x,y,heading\n1,0,0,0\n2,0,0,0\n");
  directory.write("ranges.csv", "t,beacon,range\n1,7,10\n");
  const std::string out = directory.file("out.bag");
  ASSERT_EQ(run_program("dataset_to_bag csv " + directory.path() + " " + out).exit_code, 0);
  EXPECT_DOUBLE_EQ(first_range(out).range, 10.0);
  ASSERT_EQ(
      run_program("dataset_to_bag csv --range-unit ft " + directory.path() + " " + out).exit_code,
      0);
  EXPECT_DOUBLE_EQ(first_range(out).range, 3.048);

  MatFileWriter file;
  file.add("DR", {{1.0, 0.5, 0.0}, {1.5, 0.5, 0.1}}).add("TD", {{1.2, 2.0, 7.0, 10.0}});
  file.add("TL", {{7.0, 1.0, 2.0}});
  const std::string mat = directory.write("a.mat", file.bytes());
  ASSERT_EQ(run_program("dataset_to_bag plaza " + mat + " " + out +
                        " --range-unit ft --antenna -0.25,0.5,0.75")
                .exit_code,
            0);
  EXPECT_DOUBLE_EQ(first_range(out).range, 3.048);
  const ProgramResult check = run_program("check_bag " + out);
  EXPECT_NE(check.out.find("antenna on base_link  -0.250  0.500  0.750"), std::string::npos)
      << check.out;
}

TEST(DatasetToBag, FailsWithOneLineAndLeavesNoBag) {
  const TemporaryDirectory directory;
  const std::string out = directory.file("out.bag");
  const std::string bad = directory.write("ranges.csv", "t,beacon,range\n1,7,ten\n");
  MatFileWriter late;
  late.add("DR", {{-1e65, 0.5, 0.0}, {1.5, 0.5, 0.1}}).add("TD", {{1.2, 2.0, 7.0, 10.0}});
  const std::string mat = directory.write("late.mat", late.bytes());
  const std::vector<std::pair<std::string, std::string>> failures = {
      {"plaza " + mat + " " + out, mat + ": times from -"},
      {"csv " + directory.path() + " " + out, bad + ":2: column range: 'ten' is not a number"},
      {"csv " + directory.file("none") + " " + out, "no such directory"},
      {"plaza " + directory.file("none.mat") + " " + out, "no such file"},
      {"plaza " + bad + " " + out, "is not a MATLAB file"},
      {"labyrinth " + directory.path() + " " + out, "has no file *Input.txt"},
  };
  for (const auto& [arguments, words] : failures) {
    const ProgramResult result = run_program("dataset_to_bag " + arguments);
    EXPECT_EQ(result.exit_code, 1) << arguments;
    EXPECT_TRUE(result.is_one_line_error("dataset_to_bag")) << result.error << result.out;
    EXPECT_NE(result.error.find(words), std::string::npos) << result.error;
  }
  EXPECT_EQ(directory.listing(), "late.mat ranges.csv");

  directory.write("ranges.csv", "t,beacon,range\n1,7,10\n");
  const ProgramResult result =
      run_program("dataset_to_bag csv " + directory.path() + " /nonexistent_directory/out.bag");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_TRUE(result.is_one_line_error("dataset_to_bag")) << result.error << result.out;
}

TEST(DatasetToBag, MisuseIsOneLineAndTwo) {
  for (const char* arguments :
       {"", "kitti a b", "plaza", "plaza a.mat", "plaza a.mat b.bag c.bag",
        "plaza a.mat b.bag --range-unit yd", "plaza a.mat b.bag --antenna 1,2",
        "csv a b.bag --range-unit", "csv a b.bag --antenna 1,2,3", "labyrinth a",
        "mrclam a b.bag --robot x", "mrclam a b.bag --odometry-delay 60", "victoria_park a"}) {
    const ProgramResult result = run_program(std::string("dataset_to_bag ") + arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments;
    EXPECT_TRUE(result.is_one_line_error("dataset_to_bag")) << arguments << result.error;
  }
  for (const char* arguments : {"--help", "plaza --help", "labyrinth --help", "mrclam --help",
                                "victoria_park --help", "csv --help"}) {
    const ProgramResult result = run_program(std::string("dataset_to_bag ") + arguments);
    EXPECT_EQ(result.exit_code, 0) << arguments;
    EXPECT_NE(result.out.find("Usage: rosrun pf_resampling dataset_to_bag"), std::string::npos);
  }
}

}  // namespace
}  // namespace pf_resampling
