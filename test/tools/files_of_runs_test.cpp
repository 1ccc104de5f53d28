// What programs may write: never what they read, never what is no regular file; and what they leave
// behind when they are stopped or the disk is full.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <map>
#include <vector>

#include "pf_resampling_core/test/says.hpp"
#include "test/places.hpp"
#include "test/run_program.hpp"

namespace pf_resampling {
namespace {

namespace fs = std::filesystem;

/// Of all that is in a folder: kind and mode, and for files the contents.
std::map<std::string, std::string> all_in(const std::string& folder) {
  std::map<std::string, std::string> all;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    struct stat there {};
    lstat(entry.path().c_str(), &there);
    all[entry.path().string()] =
        std::to_string(there.st_mode) +
        (S_ISREG(there.st_mode) ? " " + read_file(entry.path().string()) : "");
  }
  return all;
}

class FilesOfRuns : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryDirectory;
    ASSERT_EQ(program("simulate_bag beacons_circle ranges.bag --duration 20").exit_code, 0);
    ASSERT_EQ(program("simulate_bag indoor_two_loops drive.bag --duration 20").exit_code, 0);
    ASSERT_EQ(program("run_bag beacon_mcl ranges.bag x.bag").exit_code, 0);
    ASSERT_EQ(program("run_bag fastslam drive.bag y.bag --set particles=20 --save-map a.map "
                      "--save-checkpoint a.checkpoint")
                  .exit_code,
              0);
    folder_->write("my.yaml", "particles: 20\n");
    folder_->write("load.yaml", "map_file: {load: " + folder_->file("a.map") + "}\n");
    folder_->write("w.yaml", "waypoints: [[0, 0], [20, 0]]\nlandmarks: [[5, 2]]\n");
    folder_->write("p.mat", "MATLAB");
    for (const std::string name : {"c", "d"}) {
      fs::create_directory(folder_->file(name));
      folder_->write(name + "/odometry.csv", "t,x,y,heading\n1,0,0,0\n2,0,0,0\n");
    }
    fs::create_hard_link(folder_->file("drive.bag"), folder_->file("same.bag"));
    fs::create_symlink(folder_->file("drive.bag"), folder_->file("link.bag"));
    fs::create_symlink(folder_->file("drive.bag"), folder_->file("link.png"));
    ASSERT_EQ(mkfifo(folder_->file("fifo").c_str(), 0600), 0);
    folder_->write("read_only", "mine");
    chmod(folder_->file("read_only").c_str(), 0444);
  }
  static void TearDownTestSuite() { delete folder_; }

  /// In the folder, as a user would type it there.
  static ProgramResult program(const std::string& command) {
    const fs::path before = fs::current_path();
    fs::current_path(folder_->path());
    ProgramResult result = run_program(command);
    fs::current_path(before);
    return result;
  }

  static void expect_refused(const std::string& command, const std::vector<std::string>& words) {
    const auto before = all_in(folder_->path());
    const ProgramResult result = program(command);
    EXPECT_EQ(result.exit_code, 1) << command;
    EXPECT_TRUE(result.is_one_line_error(command.substr(0, command.find(' '))) ||
                result.error.rfind("dataset_to_bag", 0) == 0)
        << command << ": " << result.out << result.error;
    for (const std::string& word : words) {
      EXPECT_TRUE(says(result.error, word));
    }
    EXPECT_TRUE(all_in(folder_->path()) == before) << command << " changed something";
  }

  static TemporaryDirectory* folder_;
};

TemporaryDirectory* FilesOfRuns::folder_ = nullptr;

TEST_F(FilesOfRuns, WhatIsReadIsNotWritten) {
  const std::string slam = "run_bag fastslam drive.bag out.bag --set particles=20 ";
  expect_refused("run_bag fastslam drive.bag drive.bag", {"out.bag drive.bag", "in.bag drive.bag"});
  expect_refused("run_bag fastslam drive.bag same.bag", {"out.bag same.bag", "in.bag drive.bag"});
  expect_refused("run_bag fastslam link.bag ./drive.bag", {"out.bag ./drive", "in.bag link.bag"});
  expect_refused(slam + "--save-map drive.bag", {"--save-map drive.bag", "in.bag drive.bag"});
  expect_refused(slam + "--save-checkpoint drive.bag", {"--save-checkpoint drive.bag", "in.bag"});
  expect_refused(slam + "--save-map my.yaml --config my.yaml", {"--save-map my.yaml", "--config"});
  expect_refused(slam + "--save-map a.map --load-map a.map", {"--save-map a.map", "--load-map"});
  expect_refused(slam + "--save-map a.map --config load.yaml",
                 {"--save-map a.map", "map_file/load"});
  expect_refused(slam + "--save-checkpoint a.checkpoint --resume a.checkpoint",
                 {"--save-checkpoint a.checkpoint", "--resume"});
  expect_refused("simulate_bag w.yaml w.yaml", {"out.bag w.yaml", "WORLD w.yaml"});
  expect_refused("dataset_to_bag plaza p.mat p.mat", {"out.bag p.mat", "FILE.mat p.mat"});
  expect_refused("dataset_to_bag csv c c/odometry.csv",
                 {"out.bag c/odometry.csv is the same file as the input c/odometry.csv;"});
  expect_refused("dataset_to_bag csv c c", {"out.bag c", "DIRECTORY c"});
  expect_refused("evaluate_bag x.bag --json x.bag", {"--json x.bag", "bag x.bag"});
  expect_refused("survey_beacons ranges.bag --output ranges.bag", {"--output", "bag ranges.bag"});
  expect_refused("study faults ranges.bag --seeds 1 --json ranges.bag", {"--json", "bag ranges"});
  expect_refused("study faults ranges.bag --config my.yaml --seeds 1 --json my.yaml",
                 {"--json", "--config"});
}

TEST_F(FilesOfRuns, NothingIsWrittenTwice) {
  const std::string slam = "run_bag fastslam drive.bag out.bag --set particles=20 ";
  expect_refused(slam + "--save-map out.bag", {"--save-map out.bag", "out.bag out.bag"});
  expect_refused(slam + "--save-map m --save-checkpoint ./m",
                 {"--save-checkpoint ./m", "--save-map"});
  expect_refused("evaluate_bag x.bag --json x.png --plot x.png", {"--plot x.png", "--json x.png"});
}

// A FIFO stands for /dev/null, which nobody wants to lose to a test; as root a device like it is
// made and tried, too.
TEST_F(FilesOfRuns, OnlyRegularFilesAreReplaced) {
  std::map<std::string, std::string> refused = {{"fifo", "it is not a regular file"},
                                                {"link.bag", "it is not a regular file"},
                                                {"read_only", "it is read-only"},
                                                {"c", "it is not a regular file"},
                                                {"none/out", "No such file or directory"}};
  if (mknod(folder_->file("null").c_str(), S_IFCHR | 0666, makedev(1, 3)) == 0) {
    refused["null"] = "it is not a regular file";
  }
  // One program in C++ and one in Python are tried with each, the others with one.
  const std::vector<std::string> commands = {
      "run_bag beacon_mcl ranges.bag ",
      "evaluate_bag x.bag --json ",
      "run_bag beacon_mcl ranges.bag o.bag --save-checkpoint ",
      "run_bag fastslam y.bag o.bag --save-map ",
      "simulate_bag beacons_circle ",
      "dataset_to_bag csv d ",
      "survey_beacons ranges.bag --output ",
      "study faults ranges.bag --seeds 1 --json "};
  for (const auto& [name, why] : refused) {
    const std::size_t tried = name == "fifo" ? commands.size() : 2;
    for (std::size_t i = 0; i < tried; ++i) expect_refused(commands[i] + name, {name, why});
  }
  expect_refused("evaluate_bag x.bag --plot link.png", {"link.png", "it is not a regular file"});
}

TEST_F(FilesOfRuns, AnOutputOfAnEarlierRunAmongTheInputsIsReplaced) {
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(program("dataset_to_bag csv c c/out.bag").error, "");
  }
  fs::remove(folder_->file("c/out.bag"));
}

TEST_F(FilesOfRuns, AFullDiskUnderStandardOutputIsAnError) {
  ASSERT_TRUE(fs::exists("/dev/full"));  // as on every Linux
  for (const char* command :
       {"run_bag --help", "evaluate_bag --help", "study kwak --help",
        "run_bag fastslam --parameters", "check_bag drive.bag", "survey_beacons ranges.bag",
        "simulate_bag beacons_circle s.bag --duration 5", "dataset_to_bag csv c s.bag",
        "run_bag beacon_mcl ranges.bag s.bag"}) {
    const std::string tool = std::string(command).substr(0, std::string(command).find(' '));
    for (const char* out : {" > /dev/full", " >&-"}) {
      const ProgramResult result = program(command + std::string(out));
      EXPECT_EQ(result.exit_code, 1) << command << out;
      EXPECT_TRUE(says(result.error, tool + ": standard output cannot be written"));
    }
  }
}

/// Starts a program and sends it a signal while it runs.
/// Returns the signal that has ended the program, or by whose exit code it says so.
int signal_amid(const std::vector<std::string>& command, const std::string& folder, int signal,
                unsigned after_microseconds) {
  const pid_t child = fork();
  if (child == 0) {
    std::vector<std::string> words = command;
    words[0] = std::string(kProgramsFolder) + "/" + words[0];
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    std::signal(signal, SIG_DFL);  // under nohup a child inherits that it is ignored
    if (chdir(folder.c_str()) == 0) execv(arguments[0], arguments.data());
    _exit(99);
  }
  usleep(after_microseconds);
  int status = 0;
  kill(child, signal);
  waitpid(child, &status, 0);
  return WIFSIGNALED(status) ? WTERMSIG(status) : WEXITSTATUS(status) - 128;
}

TEST_F(FilesOfRuns, NothingIsLeftWhenTheyAreStopped) {
  const TemporaryDirectory temporary;
  setenv("TMPDIR", temporary.path().c_str(), 1);
  const auto before = all_in(folder_->path());
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    EXPECT_EQ(signal_amid({"run_bag", "fastslam", "drive.bag", "x.bag", "--set", "particles=50000"},
                          folder_->path(), signal, 300000),
              signal);
    EXPECT_TRUE(all_in(folder_->path()) == before) << signal;
    EXPECT_EQ(signal_amid({"evaluate_bag", "x.bag", "--quiet", "--plot", "picture.png"},
                          folder_->path(), signal, 600000),
              signal);
    EXPECT_TRUE(all_in(folder_->path()) == before) << signal;
  }
  unsetenv("TMPDIR");
  EXPECT_FALSE(says(temporary.listing(), "pf_resampling_"));
}

}  // namespace
}  // namespace pf_resampling
