#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "pf_resampling_core/error.hpp"
#include "research/studies/resampling_study.hpp"
#include "test/run_program.hpp"
#include "tools/common/files.hpp"

namespace pf_resampling {
namespace {

using nlohmann::json;

StudyRun run_with(int seed, double error, bool lost) {
  StudyRun run;
  run.seed = seed;
  run.has_errors = true;
  run.errors.cross_track = {100, error, error, error, error};
  run.errors.along_track = run.errors.cross_track;
  run.errors.cartesian = run.errors.cross_track;
  run.errors.coverage95 = 0.9;
  run.errors.converged_after = 2.0;
  run.errors.lost = lost;
  return run;
}

// Two schemes, two excitations, three seeds; one run of systematic without excitation is lost, one
// never gave a pose.
ResamplingStudy small_study() {
  ResamplingStudy study;
  study.recording = "small.bag";
  study.options.schemes = {ResamplingScheme::systematic, ResamplingScheme::multinomial};
  study.options.excitations = {Excitation::none, Excitation::regularized};
  study.options.seeds = 4;
  study.dead_reckoning = run_with(0, 7.0, true).errors;
  StudyRun silent;
  silent.seed = 4;
  using Scheme = ResamplingScheme;
  study.cells = {
      {Scheme::systematic,
       Excitation::none,
       {run_with(1, 0.2, false), run_with(2, 50.0, true), run_with(3, 0.4, false), silent}},
      {Scheme::multinomial,
       Excitation::none,
       {run_with(1, 0.3, false), run_with(2, 0.1, false), run_with(3, 0.7, false),
        run_with(4, 0.1, false)}},
      {Scheme::systematic,
       Excitation::regularized,
       {run_with(1, 0.1, false), run_with(2, 0.1, false), run_with(3, 0.1, false),
        run_with(4, 0.1, false)}},
      {Scheme::multinomial,
       Excitation::regularized,
       {run_with(1, 9.0, true), run_with(2, 9.0, true), run_with(3, 9.0, true),
        run_with(4, 9.0, true)}}};
  return study;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(ResamplingStudy, AveragesTheRunsThatWereNotLostAndCountsTheOthers) {
  const std::string text = to_markdown(small_study());
  // Systematic: of 0.2 and 0.4 the mean is 0.3, its standard error 0.1. Multinomial: mean of 0.3,
  // 0.1, 0.7, 0.1 is 0.3, sample variance 0.08, standard error sqrt(0.02).
  EXPECT_TRUE(contains(text, "| Cartesian_abs_avg | 7.000 | 0.300 ± 0.100 | 0.300 ± 0.141 |"))
      << text;
  EXPECT_TRUE(contains(text, "| Lost runs | – | 2 of 4 | 0 of 4 |")) << text;
  EXPECT_TRUE(contains(text, "| Cartesian_abs_avg | 7.000 | 0.100 ± 0.000 | – |")) << text;
  EXPECT_TRUE(contains(text, "| Lost runs | – | 0 of 4 | 4 of 4 |")) << text;
}

TEST(ResamplingStudy, PairsDifferencesBySeed) {
  const std::string text = to_markdown(small_study());
  // Seeds 1 and 3: 0.1 and 0.3.
  EXPECT_TRUE(contains(text, "minus Systematic | – | 0.2000 ± 0.1000 (2) |")) << text;
  // With excitation, systematic: 0.1 - 0.2 and 0.1 - 0.4.
  EXPECT_TRUE(contains(text, "minus Without excitation | -0.2000 ± 0.1000 (2) | – |")) << text;
}

TEST(ResamplingStudy, WritesEveryRunAsJson) {
  const json result = json::parse(to_json_text(small_study()));
  EXPECT_EQ(result["cells"].size(), 4u);
  EXPECT_EQ(result["cells"][0]["scheme"], "systematic");
  EXPECT_EQ(result["cells"][0]["lost"], 2);
  EXPECT_EQ(result["cells"][0]["runs"][1]["lost"], true);
  EXPECT_EQ(result["cells"][0]["runs"][2]["cartesian"]["mean"], 0.4);
  EXPECT_EQ(result["cells"][0]["runs"][3]["lost"], true);
}

TEST(ResamplingStudy, RefusesOptionsThatMakeNoSense) {
  ResamplingStudyOptions options;
  const auto run = [&] { return run_resampling_study("", {}, {}, {}, options, {}); };
  EXPECT_THROW(run(), Error);
  options.schemes = schemes_of_paper_m();
  options.excitations = {Excitation::none};
  options.seeds = 0;
  EXPECT_THROW(run(), Error);
  options.seeds = 1;
  options.jobs = 0;
  EXPECT_THROW(run(), Error);
}

class Study : public ::testing::Test {
 protected:
  void SetUp() override {
    const ProgramResult result =
        run_program("simulate_bag beacons_circle " + directory_.file("circle.bag") + " --seed 1");
    ASSERT_EQ(result.exit_code, 0) << result.error;
  }
  TemporaryDirectory directory_;
};

TEST_F(Study, GivesTheSameTablesWithOneAndTwoJobs) {
  const std::string command = "study resampling " + directory_.file("circle.bag") +
                              " --seeds 2 --set particles=100 --schemes systematic,multinomial";
  for (const char* jobs : {"1", "2"}) {
    const ProgramResult result =
        run_program(command + " --jobs " + jobs + " --markdown " + directory_.file(jobs) +
                    " --json " + directory_.file(std::string(jobs) + ".json"));
    ASSERT_EQ(result.exit_code, 0) << result.error;
    EXPECT_EQ(result.out + result.error, "");
  }
  EXPECT_EQ(read_file(directory_.file("1")), read_file(directory_.file("2")));
  EXPECT_EQ(read_file(directory_.file("1.json")), read_file(directory_.file("2.json")));
  EXPECT_TRUE(contains(read_file(directory_.file("1")), "`particles` = 100"));
  // The schemes do differ.
  const json cells = json::parse(read_file(directory_.file("1.json")))["cells"];
  EXPECT_NE(cells[0]["runs"][0]["cartesian"], cells[1]["runs"][0]["cartesian"]);
}

TEST_F(Study, SaysWhichSettingsOfThePapersFilterDiffer) {
  const std::string config = std::string(PF_RESAMPLING_CONFIG) + "/paper_m.yaml";
  const ProgramResult result =
      run_program("study resampling " + directory_.file("circle.bag") +
                  " --seeds 1 --schemes systematic --excitations none --config " + config);
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_TRUE(contains(result.out,
                       "Settings: `calibration/estimation` = off, `noise_estimation/ranges` = "
                       "false, `noise_estimation/odometry` = false, `yaw_rate_bias/estimate` = "
                       "false, `initialization/method` = "
                       "uniform, `recovery/enabled` = false."))
      << result.out;
}

TEST_F(Study, RefusesBadInputInOneLine) {
  const std::string bag = directory_.file("circle.bag");
  for (const std::string& arguments :
       {"resampling " + directory_.file("missing.bag"), "resampling " + bag + " --schemes best",
        "resampling " + bag + " --excitations wild", "resampling " + bag + " --seeds 0",
        "resampling " + bag + " --truth /pose", "resampling " + bag + " --set particles=-1"}) {
    const ProgramResult result = run_program("study " + arguments);
    EXPECT_EQ(result.exit_code, 1) << arguments;
    EXPECT_TRUE(result.is_one_line_error("study")) << arguments << "\n" << result.error;
  }
  EXPECT_TRUE(contains(run_program("study resampling " + bag + " --schemes best").error,
                       "residual_systematic"));
}

}  // namespace
}  // namespace pf_resampling
