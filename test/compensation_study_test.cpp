#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/simulation/simulate.hpp"
#include "research/studies/compensation_claims.hpp"
#include "research/studies/compensation_study.hpp"
#include "src/configuration/configuration.hpp"
#include "test/run_program.hpp"
#include "tools/common/files.hpp"
#include "tools/worlds/world_file.hpp"

namespace pf_resampling {
namespace {

using nlohmann::json;

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

CompensationCell cell_with(const std::string& name, const std::vector<double>& feature_errors) {
  CompensationCell cell;
  cell.variant = compensation_variants({name}).front();
  for (const double error : feature_errors) {
    CompensationFigures figures;
    figures.feature_error = error;
    figures.calls = 10.0;
    cell.runs.push_back(figures);
  }
  return cell;
}

CompensationStudy study_with(const std::vector<CompensationCell>& cells) {
  CompensationStudy study;
  study.world = "indoor_two_loops";
  study.options.base = paper_k_options();
  study.options.drives = static_cast<int>(cells.front().runs.size());
  study.cells = cells;
  return study;
}

TEST(CompensationClaims, HoldBySignAndByStandardErrors) {
  // Differences of -0.1, -0.1, -0.1, -0.1 +- 0.02: mean -0.1, standard error 0.02 sqrt(4/3 / 4).
  const CompensationStudy clear = study_with({cell_with("RSR", {0.3, 0.4, 0.3, 0.4}),
                                              cell_with("compensation", {0.18, 0.32, 0.18, 0.32})});
  const Claim point = five_points(clear)[1];
  ASSERT_EQ(point.differences.size(), 1u);
  EXPECT_NEAR(point.differences[0].difference.mean, -0.1, 1e-12);
  EXPECT_NEAR(point.differences[0].difference.standard_error, 0.02 / std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(point.differences[0].standard_errors(), 5.0 * std::sqrt(3.0), 1e-9);
  EXPECT_EQ(point.verdict(), "holds");

  // -0.2 and 0.0: one standard error below zero, where more than three are asked for.
  const CompensationStudy weak =
      study_with({cell_with("RSR", {0.3, 0.3}), cell_with("compensation", {0.1, 0.3})});
  EXPECT_EQ(five_points(weak)[1].verdict(), "does not hold, but chance is not ruled out");
  const CompensationStudy opposite =
      study_with({cell_with("RSR", {0.3, 0.3}), cell_with("compensation", {0.4, 0.41})});
  EXPECT_EQ(five_points(opposite)[1].verdict(), "does not hold");
}

TEST(CompensationClaims, WithoutThreeStandardErrorsChanceIsNotRuledOut) {
  // Point 5 asks for the sign alone.
  const CompensationStudy study =
      study_with({cell_with("RSR", {0.3, 0.3}), cell_with("compensation M=50", {0.1, 0.299})});
  EXPECT_EQ(five_points(study)[4].verdict(), "holds, but chance is not ruled out");
}

TEST(CompensationClaims, OfEqualFiltersHoldNothing) {
  const CompensationStudy study =
      study_with({cell_with("RSR", {0.3, 0.4}), cell_with("compensation M=50", {0.3, 0.4})});
  EXPECT_FALSE(five_points(study)[4].holds());
  // Calls of 10 are not more than twice 10.
  const CompensationStudy calls = study_with(
      {cell_with("compensation", {0.3, 0.4}), cell_with("compensation T_N=1", {0.3, 0.4})});
  const Claim point = five_points(calls)[3];
  EXPECT_NEAR(point.differences[0].difference.mean, -10.0, 1e-12);
  EXPECT_FALSE(point.holds());
}

TEST(CompensationClaims, SayWhatTheStudyLacks) {
  const CompensationStudy study = study_with({cell_with("RSR", {0.3, 0.4})});
  for (const Claim& claim : five_points(study)) {
    EXPECT_FALSE(claim.is_known());
    EXPECT_FALSE(claim.holds());
    EXPECT_EQ(claim.verdict(), "not in this study");
  }
}

TEST(CompensationVariants, HaveNamesOfTheirOwnAndOptionsThatMakeSense) {
  const FastSlamOptions base = paper_k_options();
  std::vector<std::string> names;
  for (const CompensationVariant& variant : all_compensation_variants()) {
    EXPECT_NO_THROW(validate(options_of(variant, base))) << variant.name;
    EXPECT_EQ(std::count(names.begin(), names.end(), variant.name), 0) << variant.name;
    names.push_back(variant.name);
  }
  const auto options = [&](const std::string& name) {
    return options_of(compensation_variants({name}).front(), base);
  };
  const FastSlamOptions gentle = options("compensation random 20 %");
  EXPECT_EQ(gentle.strategy.renewal, Renewal::compensation);
  EXPECT_EQ(gentle.strategy.compensation.pairing, Pairing::random);
  EXPECT_EQ(gentle.strategy.compensation.ratio, 0.2);
  EXPECT_EQ(options("RSR").strategy.resampling.scheme, ResamplingScheme::residual_systematic);
  EXPECT_EQ(options("RSR M=500").particles, 500);
  EXPECT_EQ(options("compensation T_N=1").strategy.threshold, 1.0);
}

TEST(PaperK, HasTheNumbersOfItsSection4) {
  const FastSlamOptions options = paper_k_options();
  EXPECT_EQ(options.particles, 100);
  EXPECT_EQ(options.strategy.threshold, 0.75);
  EXPECT_EQ(options.strategy.resampling.rank_max, 1.5);
  EXPECT_EQ(options.sensor.range_sigma, 0.1);
  EXPECT_NEAR(options.sensor.bearing_sigma, kPi / 180.0, 1e-8);
  // White noise of 0.3 m/s and 3 degrees/s, drawn anew every 25 ms, over one second: the sum of 40
  // independent steps of 0.3 * 0.025 m.
  EXPECT_NEAR(options.odometry.along_per_time, 0.3 * 0.025 * std::sqrt(40.0), 1e-8);
  EXPECT_NEAR(options.odometry.heading_per_time, 3.0 * kPi / 180.0 * 0.025 * std::sqrt(40.0), 1e-8);
  EXPECT_EQ(options.strategy.excitation.method, Excitation::none);
}

// What the file leaves out would follow the defaults, which may change. A parameter that is new
// has to be written there, with what makes it do nothing, unless known ids leave it without a use.
TEST(PaperK, SaysWhatEveryParameterIsThatConcernsIt) {
  const std::map<std::string, std::string> values =
      parse_configuration(paper_k_text(), "paper_k.yaml").values;
  FastSlamOptions options;
  for (const Parameter& parameter : parameters_of(&options)) {
    const std::string& name = parameter.name;
    const std::string group = name.substr(0, name.find('/'));
    const bool concerns_it = group == "version" || group == "population" || group == "odometry" ||
                             group == "sensor" || group == "association" ||
                             name == "excitation/method" || name == "odometry_errors/estimate";
    const bool is_without_use = name == "population/every_n" || name == "sensor/maximum_range" ||
                                name == "sensor/field_of_view" ||
                                name.find("log_odds") != std::string::npos;
    if (!concerns_it || is_without_use) continue;
    EXPECT_EQ(values.count(name), 1u)
        << "config/paper_k.yaml does not say what " << name << " is in K's filter";
  }
}

TEST(CompensationStudy, RunsFiltersOnTheSameDrives) {
  CompensationStudyOptions options;
  options.base = paper_k_options();
  options.variants =
      compensation_variants({"NR", "RSR", "systematic", "compensation", "compensation T_N=1"});
  options.drives = 3;
  const World world = load_world("indoor_two_loops");
  std::uint64_t last = 0;
  const CompensationStudy study = run_compensation_study(load_world("indoor_two_loops"), options,
                                                         [&](std::uint64_t done) { last = done; });
  EXPECT_EQ(last, 15u);
  const CompensationCell& none = *study.find("NR");
  const CompensationCell& rsr = *study.find("RSR");
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(none.runs[i].calls, 0.0);
    EXPECT_EQ(none.runs[i].distinct, 100.0);
    EXPECT_EQ(study.find("compensation")->runs[i].distinct, 100.0);
    EXPECT_GE(rsr.runs[i].distinct_end, 1.0);
    EXPECT_LT(rsr.runs[i].distinct_end, 100.0);
    // RSR and systematic resampling take the same particles for the same random number.
    EXPECT_EQ(rsr.runs[i].feature_error, study.find("systematic")->runs[i].feature_error);
    EXPECT_LE(rsr.runs[i].map_error_aligned, rsr.runs[i].map_error);
    EXPECT_GT(rsr.runs[i].processor_ms, 0.0);
    // With equal weights, as after a compensation, eq. 5 is the error of the mean and the spread
    // about it.
    const CompensationFigures& always = study.find("compensation T_N=1")->runs[i];
    EXPECT_GT(always.feature_error, always.map_error);
    // K section 5.2: T_N = 1 means after each observation.
    const std::vector<SimulatedDrive::Scan> scans = simulate(world, i + 1).scans;
    EXPECT_EQ(static_cast<std::ptrdiff_t>(always.calls),
              std::count_if(scans.begin(), scans.end(),
                            [](const auto& scan) { return !scan.observations.empty(); }));
  }
  EXPECT_NEAR(study.times[1] - study.times[0], 0.2, 1e-9);
  EXPECT_EQ(study.closures.size(), 2u);
  EXPECT_EQ(rsr.curves.feature_error.size(), study.times.size());
  double sum = 0.0;
  for (const CompensationFigures& run : rsr.runs) sum += run.feature_error_end;
  EXPECT_NEAR(rsr.curves.feature_error.back(), sum / 3.0, 1e-12);
}

TEST(CompensationStudy, RefusesOptionsThatMakeNoSense) {
  const World world = load_world("indoor_two_loops");
  CompensationStudyOptions options;
  options.base = paper_k_options();
  options.variants = compensation_variants({"RSR"});
  const auto run = [&](const World& in) {
    return run_compensation_study(in, options, [](std::uint64_t) {});
  };
  options.drives = 1;
  EXPECT_THROW(run(world), Error);
  options.drives = 2;
  options.jobs = 0;
  EXPECT_THROW(run(world), Error);
  options.jobs = 1;
  EXPECT_THROW(run(load_world("beacons_circle")), Error);
  options.base.association.method = DataAssociation::maximum_likelihood;
  EXPECT_THROW(run(world), Error);
  EXPECT_THROW(compensation_variants({"RSR", "best"}), Error);
}

// Without what is measured by the clock.
json figures_of(const std::string& file) {
  json result = json::parse(read_file(file));
  for (const json& name : result["by_the_clock"]) {
    for (json& variant : result["variants"]) variant["figures"].erase(name.get<std::string>());
  }
  return result;
}

TEST(CompensationProgram, GivesTheSameFiguresWithOneAndTwoJobs) {
  const TemporaryDirectory directory;
  for (const char* jobs : {"1", "2"}) {
    const ProgramResult result = run_program(
        "study compensation --seeds 4 --variants 'RSR,compensation,compensation 20 %' --jobs " +
        std::string(jobs) + " --markdown " + directory.file(jobs) + " --json " +
        directory.file(std::string(jobs) + ".json"));
    ASSERT_EQ(result.exit_code, 0) << result.error;
    EXPECT_EQ(result.out + result.error, "");
  }
  const json one = figures_of(directory.file("1.json"));
  EXPECT_EQ(one.dump(), figures_of(directory.file("2.json")).dump());
  ASSERT_EQ(one["variants"].size(), 3u);
  EXPECT_EQ(one["variants"][2]["settings"]["population/compensation/ratio"], "1");
  EXPECT_NE(one["variants"][0]["runs"][0]["feature_error"],
            one["variants"][1]["runs"][0]["feature_error"]);
  EXPECT_EQ(one["five_points"].size(), 5u);
  EXPECT_TRUE(one["five_points"][0]["holds"].is_null());
  EXPECT_TRUE(one["five_points"][1]["holds"].is_boolean());
  EXPECT_TRUE(contains(read_file(directory.file("1")), "not in this study"));
}

TEST(CompensationProgram, TakesOtherWorldsAndSettingsAndSaysSo) {
  const ProgramResult result =
      run_program("study compensation --seeds 2 --variants RSR --set particles=20");
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_TRUE(contains(result.out, "but for `particles` = 20")) << result.out.substr(0, 500);
}

TEST(CompensationProgram, HasItsPicturesDrawn) {
  const std::string script =
      "/usr/bin/python3 " + std::string(PF_RESAMPLING_SOURCE) + "/scripts/plot_compensation.py ";
  if (std::system("/usr/bin/python3 -c 'import matplotlib' 2>/dev/null") != 0) {
    GTEST_SKIP() << "matplotlib is not installed";
  }
  const TemporaryDirectory directory;
  const std::string study = directory.file("study.json");
  const ProgramResult result = run_program(
      "study compensation --seeds 2 --variants 'NR,RSR,RBR,compensation,compensation "
      "20 %,RSR M=500' --json " +
      study);
  ASSERT_EQ(result.exit_code, 0) << result.error;
  for (const std::string picture : {"courses", "tradeoff"}) {
    const std::string file = directory.file(picture + ".png");
    EXPECT_EQ(std::system((script + picture + " " + study + " " + file).c_str()), 0);
    EXPECT_EQ(read_file(file).substr(1, 3), "PNG");
  }
  EXPECT_NE(std::system((script + "weather " + study + " x.png 2>/dev/null").c_str()), 0);
}

TEST(CompensationProgram, RefusesBadInputInOneLine) {
  for (const char* arguments :
       {"no_such_world", "beacons_circle", "--variants best", "--seeds 1", "--jobs 0",
        "--set particles=-1", "--set nothing", "--config missing.yaml"}) {
    const ProgramResult result = run_program(std::string("study compensation ") + arguments);
    EXPECT_EQ(result.exit_code, 1) << arguments;
    EXPECT_TRUE(result.is_one_line_error("study")) << arguments << "\n" << result.error;
  }
  for (const char* arguments : {"", "weather", "compensation --speed 3"}) {
    const ProgramResult result = run_program(std::string("study ") + arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments;
    EXPECT_TRUE(result.is_one_line_error("study")) << arguments << "\n" << result.error;
  }
}

}  // namespace
}  // namespace pf_resampling
