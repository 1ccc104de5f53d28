#include "research/studies/study_folder.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/evaluation/statistics.hpp"
#include "test/run_program.hpp"
#include "test/temporary_directory.hpp"
#include "tools/common/files.hpp"

namespace pf_resampling {
namespace {

const char* const kTables[] = {"trials.csv", "curves.csv", "paths.csv", "places.csv"};

StudyDefinition small_study() {
  return parse_study(R"(study: small
filter: fastslam
preset: kwak2008
settings: {particles: 20}
trials: 5
block: 2
problems:
  - {name: short, world: indoor_two_loops, duration: 4}
  - {name: longer, world: indoor_two_loops, duration: 14}
groups:
  - name: All
    filters:
      - {name: RSR}
      - {name: compensation, settings: {population/renewal: compensation}}
      - {name: EKF-SLAM, estimator: ekf_slam}
)",
                     "small.yaml", "");
}

void run(StudyFolder* folder, const StudyShard& shard = {}, int jobs = 1) {
  folder->run(shard, jobs, [](std::uint64_t) {});
}

/// The whole study in a folder, merged.
void run_all(const std::string& path, const StudyDefinition& study, int jobs = 1) {
  StudyFolder folder(path, study);
  run(&folder, {}, jobs);
  folder.merge();
}

void expect_same_tables(const std::string& a, const std::string& b) {
  for (const char* table : kTables) {
    const std::string text = read_file(a + "/" + table);
    EXPECT_GT(text.size(), 50u) << table;
    EXPECT_EQ(text, read_file(b + "/" + table)) << table;
  }
}

/// Rows of a table with a heading, by its words.
std::vector<std::map<std::string, std::string>> rows_of(const std::string& path) {
  std::ifstream file(path);
  std::vector<std::string> heading;
  std::vector<std::map<std::string, std::string>> rows;
  for (std::string line; std::getline(file, line);) {
    std::vector<std::string> cells;
    std::string cell;
    for (std::istringstream words(line + ","); std::getline(words, cell, ',');) {
      cells.push_back(cell);
    }
    if (heading.empty()) {
      heading = cells;
      continue;
    }
    std::map<std::string, std::string> row;
    for (std::size_t i = 0; i < heading.size(); ++i) row[heading[i]] = cells.at(i);
    rows.push_back(row);
  }
  return rows;
}

std::string error_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return "";
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

class StudyFolderTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    directory_ = new TemporaryDirectory;
    run_all(whole(), small_study());
  }
  static void TearDownTestSuite() { delete directory_; }

  static std::string whole() { return directory_->file("whole"); }
  static std::string file(const std::string& name) { return directory_->file(name); }

 private:
  static TemporaryDirectory* directory_;
};
TemporaryDirectory* StudyFolderTest::directory_ = nullptr;

TEST_F(StudyFolderTest, HasARowForEveryTrial) {
  const auto rows = rows_of(whole() + "/trials.csv");
  ASSERT_EQ(rows.size(), 2u * 5u * 3u);
  EXPECT_EQ(rows[0].at("problem"), "short");
  EXPECT_EQ(rows[29].at("problem"), "longer");
  EXPECT_EQ(rows[29].at("filter"), "EKF-SLAM");
  EXPECT_EQ(rows[29].at("seed"), "5");
  EXPECT_EQ(rows[29].at("calls"), "");                                    // it renews nothing
  EXPECT_NE(rows[27].at("feature_error"), rows[24].at("feature_error"));  // another drive
  // The first problem ends before its loop closes: B is a figure of the second alone.
  EXPECT_EQ(rows[0].at("feature_error_drop_at_B"), "");
  EXPECT_NE(rows[27].at("feature_error_drop_at_B"), "");
  EXPECT_EQ(rows_of(whole() + "/times.csv").size(), 30u);
}

TEST_F(StudyFolderTest, CurvesAreMeansAndDeviationsOfTheTrials) {
  std::vector<double> ends;
  for (const auto& row : rows_of(whole() + "/trials.csv")) {
    if (row.at("problem") == "short" && row.at("filter") == "RSR") {
      ends.push_back(std::stod(row.at("feature_error_end")));
    }
  }
  std::map<std::string, std::string> last;
  for (const auto& row : rows_of(whole() + "/curves.csv")) {
    if (row.at("problem") == "short" && row.at("filter") == "RSR") last = row;
  }
  const MeanEstimate mean = mean_of(ends);
  EXPECT_EQ(last.at("feature_error_count"), "5");
  EXPECT_NEAR(std::stod(last.at("feature_error_mean")), mean.mean, 1e-7);
  EXPECT_NEAR(std::stod(last.at("feature_error_sd")), mean.standard_error * std::sqrt(5.0), 1e-7);
}

TEST_F(StudyFolderTest, IsTheSameWithManyJobs) {
  run_all(file("jobs"), small_study(), 3);
  expect_same_tables(whole(), file("jobs"));
}

TEST_F(StudyFolderTest, IsTheSameFromShards) {
  const std::string path = file("shards");
  for (const int index : {2, 0, 1}) {  // in any order, each by a program of its own
    StudyFolder folder(path, small_study());
    if (index != 2) {
      EXPECT_TRUE(contains(error_of([&] { folder.merge(); }), "blocks are missing")) << index;
    }
    run(&folder, {index, 3});
    EXPECT_EQ(folder.drives({index, 3}), 0u);
  }
  StudyFolder(path, definition_in(path)).merge();
  expect_same_tables(whole(), path);
}

TEST_F(StudyFolderTest, GoesOnWhereItWasInterrupted) {
  const std::string path = file("resumed");
  StudyFolder folder(path, small_study());
  EXPECT_EQ(folder.drives({}), 10u);
  run(&folder, {1, 2}, 2);  // what had been run
  EXPECT_EQ(folder.drives({}), 5u);
  run_all(path, small_study());
  expect_same_tables(whole(), path);
  // Paths that were lost come back with their block.
  std::filesystem::remove(path + "/blocks/short-paths");
  EXPECT_EQ(StudyFolder(path, small_study()).missing(),
            std::vector<std::string>{"short-0000001-0000002"});
  run_all(path, small_study());
  expect_same_tables(whole(), path);
  // A block that was lost is run alone.
  std::filesystem::remove(path + "/blocks/longer-0000003-0000004");
  StudyFolder again(path, small_study());
  EXPECT_EQ(again.missing(), std::vector<std::string>{"longer-0000003-0000004"});
  EXPECT_EQ(again.drives({}), 2u);
  run_all(path, small_study());
  expect_same_tables(whole(), path);
}

TEST_F(StudyFolderTest, MoreTrialsKeepTheFirst) {
  const std::string path = file("more");
  StudyDefinition study = small_study();
  study.trials = 2;
  run_all(path, study);
  const std::string before = read_file(path + "/trials.csv");
  study.trials = 5;
  run_all(path, study);
  expect_same_tables(whole(), path);
  EXPECT_TRUE(contains(read_file(path + "/trials.csv"), before.substr(before.find('\n'), 200)));
}

// A shard that was given fewer trials than the others once took theirs out of the study.
TEST_F(StudyFolderTest, FewerTrialsTakeNoneAway) {
  const std::string path = file("fewer");
  StudyDefinition study = small_study();
  run_all(path, study);
  study.trials = 2;
  run_all(path, study);
  expect_same_tables(whole(), path);
  EXPECT_EQ(definition_in(path).trials, small_study().trials);
}

TEST_F(StudyFolderTest, AnyRowIsRunAgainAlone) {
  const StudyFolder folder(whole(), definition_in(whole()));
  const std::string trials = read_file(whole() + "/trials.csv");
  for (const char* filter : {"RSR", "compensation", "EKF-SLAM"}) {
    const std::string row = folder.row_of("longer", filter, 4);
    EXPECT_TRUE(contains(trials, "\n" + row)) << row;
  }
  EXPECT_TRUE(contains(error_of([&] { folder.row_of("longer", "best", 4); }), "known: RSR"));
  EXPECT_TRUE(contains(error_of([&] { folder.row_of("far", "RSR", 4); }), "known: short, longer"));
}

TEST_F(StudyFolderTest, RefusesAFolderOfAnotherStudy) {
  StudyDefinition other = small_study();
  other.filters[1].settings["population/compensation/ratio"] = "0.2";
  EXPECT_TRUE(contains(error_of([&] { StudyFolder(whole(), other); }), "another study"));
  other = small_study();
  other.problems[0].duration = 5.0;
  EXPECT_TRUE(contains(error_of([&] { StudyFolder(whole(), other); }), "problems differ"));
  other = small_study();
  other.problems[0].config = "other.yaml";
  EXPECT_TRUE(contains(error_of([&] { StudyFolder(whole(), other); }), "problems differ"));
  const TemporaryDirectory full;
  full.write("mine.txt", "keep");
  EXPECT_TRUE(
      contains(error_of([&] { StudyFolder(full.path(), small_study()); }), "neither empty"));
  EXPECT_TRUE(contains(error_of([&] { definition_in(full.path()); }), "no study"));
  EXPECT_TRUE(contains(error_of([&] { StudyFolder(full.file("mine.txt"), small_study()); }),
                       "neither empty"));
}

TEST_F(StudyFolderTest, BeginsAFolderThatAnotherShardIsBeginning) {
  const TemporaryDirectory begun;
  begun.write("study.json.part-1-1", "{");
  std::filesystem::create_directory(begun.file("blocks"));
  begun.write("blocks/shard-1-of-2", "");
  StudyFolder(begun.path(), small_study());
  EXPECT_EQ(definition_in(begun.path()).name, "small");
}

TEST_F(StudyFolderTest, RefusesWhatWasDamaged) {
  const std::string path = file("damaged");
  run_all(path, small_study());
  const std::string block = path + "/blocks/short-0000001-0000002";
  const std::string whole_block = read_file(block);
  for (const std::string& text :
       {std::string(), std::string("end\n"), whole_block.substr(0, whole_block.size() / 2),
        whole_block + "trial 1\n", std::string("trial nan\nend\n")}) {
    write_file(block, text);
    const StudyFolder folder(path, small_study());
    EXPECT_TRUE(contains(error_of([&] { folder.merge(); }), block)) << text.size();
  }
  write_file(path + "/study.json", "{\"format\": 1}");
  EXPECT_TRUE(contains(error_of([&] { definition_in(path); }), "damaged"));
  write_file(path + "/study.json", "{\"format\": 2}");
  EXPECT_TRUE(contains(error_of([&] { definition_in(path); }), "format 2"));
}

// What a damaged study.json says of the study, its format being right.
TEST_F(StudyFolderTest, NamesTheStudyFileThatWasDamaged) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("study.json");
  const auto good = nlohmann::json::parse(read_file(whole() + "/study.json"));
  const nlohmann::json huge = 1e18;
  for (const auto& [key, value] :
       std::vector<std::pair<std::string, nlohmann::json>>{{"trials", "x"},
                                                           {"trials", huge},
                                                           {"trials", std::uint64_t{1} << 63},
                                                           {"trials", 0},
                                                           {"trials", 1.5},
                                                           {"trials", true},
                                                           {"block", huge},
                                                           {"problems", {1}},
                                                           {"problems", 1},
                                                           {"problems", {{{"source", 1}}}},
                                                           {"format", {1}}}) {
    auto damaged = good;
    damaged[key] = value;
    write_file(path, damaged.dump());
    for (const std::string& error :
         {error_of([&] { definition_in(directory.path()); }), key == "block" ? path : error_of([&] {
            StudyFolder(directory.path(), small_study());
          })}) {
      EXPECT_EQ(error.rfind(path, 0), 0u) << damaged[key] << ": " << error;
    }
    EXPECT_EQ(read_file(path), damaged.dump());
  }
}

// Whoever may write into a shared folder could lead the blocks elsewhere.
TEST_F(StudyFolderTest, WritesThroughNoLink) {
  const TemporaryDirectory elsewhere;
  for (const bool is_link : {true, false}) {
    const TemporaryDirectory directory;
    const std::string blocks = directory.file("blocks");
    is_link ? std::filesystem::create_directory_symlink(elsewhere.path(), blocks)
            : write_file(blocks, "mine");
    const std::string error = error_of([&] { StudyFolder(directory.path(), small_study()); });
    EXPECT_EQ(error, blocks + " is " + (is_link ? "a symbolic link" : "no folder") +
                         "; remove or rename it");
    EXPECT_FALSE(std::filesystem::exists(directory.file("study.json")));
  }
  EXPECT_TRUE(std::filesystem::is_empty(elsewhere.path()));
}

TEST(StudyProgram, RunsMergesRepeatsAndRefuses) {
  const TemporaryDirectory directory;
  const std::string yaml = directory.write("my.yaml", R"(study: my
filter: beacon_mcl
settings: {particles: 50}
trials: 2
problems: [{name: circle, world: beacons_circle, duration: 60, calibrated: true}]
groups:
  - name: All
    filters:
      - {name: mine}
      - {name: blind, calibrated: false, settings: {calibration/estimation: "off"}}
)");
  const std::string folder = directory.file("out");
  const ProgramResult first = run_program("study " + yaml + " " + folder + " --shard 1/2 --jobs 1");
  EXPECT_EQ(first.exit_code, 0) << first.error;
  EXPECT_TRUE(contains(first.out, "study merge " + folder)) << first.out;
  const ProgramResult early = run_program("study merge " + folder);
  EXPECT_EQ(early.exit_code, 1);
  EXPECT_TRUE(early.is_one_line_error("study")) << early.error;
  const ProgramResult second = run_program("study " + yaml + " " + folder);
  EXPECT_EQ(second.exit_code, 0) << second.error;
  const auto rows = rows_of(folder + "/trials.csv");
  ASSERT_EQ(rows.size(), 6u);
  EXPECT_EQ(rows[0].at("filter"), "dead reckoning");
  EXPECT_EQ(rows[0].at("lost"), "");
  EXPECT_NE(rows[0].at("cartesian_mean"), "");
  EXPECT_NE(rows[1].at("cartesian_mean"), rows[2].at("cartesian_mean"));
  EXPECT_NE(rows[1].at("cartesian_mean"), rows[4].at("cartesian_mean"));  // another drive
  const ProgramResult again = run_program("study trial " + folder + " circle blind 2");
  EXPECT_EQ(again.exit_code, 0) << again.error;
  EXPECT_TRUE(contains(read_file(folder + "/trials.csv"), "\n" + again.out)) << again.out;
  EXPECT_EQ(run_program("study merge " + folder).exit_code, 0);

  for (const std::string& arguments :
       {"weather " + folder, "trial " + folder + " circle best 1", "merge " + directory.path(),
        "report " + directory.path(), yaml + " " + folder + " --trials 0",
        yaml + " " + folder + " --jobs 0", "kwak " + folder}) {
    const ProgramResult result = run_program("study " + arguments);
    EXPECT_EQ(result.exit_code, 1) << arguments;
    EXPECT_TRUE(result.is_one_line_error("study")) << arguments << "\n" << result.error;
  }
  for (const std::string& arguments :
       {std::string(), std::string("kwak"), yaml + " " + folder + " --shard 3/2",
        yaml + " " + folder + " --shard one", "trial " + folder + " circle blind 0",
        yaml + " " + folder + " --speed 3"}) {
    const ProgramResult result = run_program("study " + arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments;
    EXPECT_TRUE(result.is_one_line_error("study")) << arguments << "\n" << result.error;
  }
}

}  // namespace
}  // namespace pf_resampling
