#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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

const json& row_of(const StudyReport& report, const std::string& scheme,
                   const std::string& excitation) {
  const auto found = std::find_if(
      report.summary.begin(), report.summary.end(),
      [&](const json& row) { return row["scheme"] == scheme && row["excitation"] == excitation; });
  if (found == report.summary.end()) throw Error("no row of " + scheme + ", " + excitation);
  return *found;
}

void expect_estimate(const json& cell, double mean, double standard_error, int count) {
  ASSERT_TRUE(cell.is_object()) << cell;
  EXPECT_NEAR(cell["mean"].get<double>(), mean, 1e-12);
  EXPECT_NEAR(cell["standard_error"].get<double>(), standard_error, 1e-12);
  EXPECT_EQ(cell["count"], count);
}

TEST(ResamplingStudy, AveragesTheRunsThatWereNotLostAndCountsTheOthers) {
  const StudyReport report = report_of(small_study());
  // Systematic: of 0.2 and 0.4 the mean is 0.3, its standard error 0.1. Multinomial: mean of 0.3,
  // 0.1, 0.7, 0.1 is 0.3, sample variance 0.08, standard error sqrt(0.02).
  expect_estimate(row_of(report, "systematic", "none")["cartesian_mean"], 0.3, 0.1, 2);
  expect_estimate(row_of(report, "multinomial", "none")["cartesian_mean"], 0.3, std::sqrt(0.02), 4);
  expect_estimate(row_of(report, "systematic", "regularized")["cartesian_mean"], 0.1, 0.0, 4);
  EXPECT_EQ(row_of(report, "systematic", "none")["lost"], 2);
  EXPECT_EQ(row_of(report, "multinomial", "none")["lost"], 0);
  EXPECT_EQ(row_of(report, "multinomial", "regularized")["lost"], 4);
  EXPECT_TRUE(row_of(report, "multinomial", "regularized")["cartesian_mean"].is_null());
  EXPECT_EQ(row_of(report, "dead reckoning", "")["cartesian_mean"], 7.0);
}

TEST(ResamplingStudy, PairsDifferencesBySeed) {
  const StudyReport report = report_of(small_study());
  // Seeds 1 and 3: 0.1 and 0.3.
  expect_estimate(row_of(report, "multinomial", "none")["minus_reference_scheme"], 0.2, 0.1, 2);
  // With excitation, systematic: 0.1 - 0.2 and 0.1 - 0.4.
  expect_estimate(row_of(report, "systematic", "regularized")["minus_first_excitation"], -0.2, 0.1,
                  2);
  EXPECT_EQ(row_of(report, "systematic", "none").count("minus_reference_scheme"), 0u);
}

TEST(StudyReport, WritesEveryRunAsJsonAndCsv) {
  const StudyReport report = report_of(small_study());
  const json result = json::parse(to_json_text(report));
  ASSERT_EQ(result["runs"].size(), 16u);
  EXPECT_EQ(result["runs"][1]["lost"], true);
  EXPECT_EQ(result["runs"][2]["cartesian_mean"], 0.4);
  EXPECT_EQ(result["runs"][3]["lost"], true);
  EXPECT_EQ(result["summary"].size(), 5u);

  const std::string csv = to_csv(report);
  EXPECT_EQ(csv.rfind("excitation,scheme,seed,lost,cross_track_mean,", 0), 0u) << csv;
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 17);
  EXPECT_TRUE(contains(csv, "\n\"none\",\"systematic\",3,false,0.4,")) << csv;
  // The run that never gave a pose has no figures: as many cells, all empty.
  EXPECT_TRUE(contains(csv, "\n\"none\",\"systematic\",4,true,,,,,,,,,,,,,,,\n")) << csv;
}

// Cells of every kind, by hand.
TEST(StudyReport, PrintsATableWithDashesForWhatThereIsNot) {
  StudyReport report;
  report.about = {{"seeds", 2}, {"settings", {{"particles", "20"}}}};
  report.columns = {{"name", "filter"}, {"error", "error", 2}, {"good", "good"}};
  report.summary = {
      {{"name", "a"}, {"error", to_json(MeanEstimate{2, 0.5, 0.125})}, {"good", true}},
      {{"name", "b"}, {"error", to_json(MeanEstimate{})}, {"good", false}},
      {{"name", "c"}, {"error", to_json(MeanEstimate{1, 0.25, 0.0})}},
      {{"name", "d"}, {"error", 3e6}}};
  const std::string text = to_text(report);
  for (const char* part :
       {"seeds: 2\n", "settings: particles = 20\n", "0.50 ± 0.12", "no", "0.25", "> 10000", "–"}) {
    EXPECT_TRUE(contains(text, part)) << part << "\n" << text;
  }
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 2 + 1 + 5) << text;
}

TEST(StudyReport, QuotesTextInCsv) {
  StudyReport report;
  report.figures_of_run = {"alarm", "delay"};
  report.runs = {{{"alarm", "a \"b\", c"}, {"delay", std::nan("")}}};
  EXPECT_EQ(to_csv(report), "alarm,delay\n\"a \"\"b\"\", c\",\n");
}

TEST(ResamplingStudy, RefusesOptionsThatMakeNoSense) {
  ResamplingStudyOptions options;
  const auto run = [&] { return run_resampling_study("", {}, {}, {}, options, {}); };
  EXPECT_THROW(run(), Error);
  options.schemes = schemes_of_mahmoud();
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
  std::vector<std::string> tables;
  for (const char* jobs : {"1", "2"}) {
    const ProgramResult result =
        run_program(command + " --jobs " + jobs + " --csv " + directory_.file(jobs) + " --json " +
                    directory_.file(std::string(jobs) + ".json"));
    ASSERT_EQ(result.exit_code, 0) << result.error;
    EXPECT_EQ(result.error, "");
    EXPECT_TRUE(contains(result.out, "\nexcitation ")) << result.out;
    tables.push_back(result.out);
  }
  EXPECT_EQ(tables[0], tables[1]);
  EXPECT_EQ(read_file(directory_.file("1")), read_file(directory_.file("2")));
  EXPECT_EQ(read_file(directory_.file("1.json")), read_file(directory_.file("2.json")));
  EXPECT_TRUE(contains(tables[0], "settings: particles = 100\n"));
  // The schemes do differ.
  const json runs = json::parse(read_file(directory_.file("1.json")))["runs"];
  EXPECT_NE(runs[0]["scheme"], runs[2]["scheme"]);
  EXPECT_NE(runs[0]["cartesian_mean"], runs[2]["cartesian_mean"]);
}

TEST_F(Study, SaysWhichSettingsOfThePapersFilterDiffer) {
  const std::string config = std::string(PF_RESAMPLING_CONFIG) + "/mahmoud2012.yaml";
  const ProgramResult result =
      run_program("study resampling " + directory_.file("circle.bag") +
                  " --seeds 1 --schemes systematic --excitations none --config " + config);
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_TRUE(contains(result.out,
                       "settings: calibration/estimation = off, initialization/method = uniform, "
                       "noise_estimation/odometry = false, noise_estimation/ranges = false, "
                       "recovery/enabled = false, yaw_rate_bias/estimate = false\n"))
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
