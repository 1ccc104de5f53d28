#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/simulation/simulate.hpp"
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

TEST(CompensationVariants, HaveNamesOfTheirOwnAndOptionsThatMakeSense) {
  const FastSlamOptions base = kwak2008_options();
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

TEST(Kwak2008, HasTheNumbersOfItsSection4) {
  const FastSlamOptions options = kwak2008_options();
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

// What the preset leaves out would follow the defaults, which may change. A parameter that is new
// has to be written there, with what makes it do nothing, unless known ids leave it without a use.
TEST(Kwak2008, SaysWhatEveryParameterIsThatConcernsIt) {
  const std::map<std::string, std::string>& values =
      preset_named(fastslam_presets(), "kwak2008").values;
  FastSlamOptions options;
  for (const Parameter& parameter : parameters_of(&options)) {
    const std::string& name = parameter.name;
    const std::string group = name.substr(0, name.find('/'));
    const bool concerns_it = group == "version" || group == "population" || group == "odometry" ||
                             group == "sensor" || group == "association" ||
                             name == "excitation/method" || name == "odometry_errors/estimate";
    const bool is_without_use = name == "population/every_n" || name == "sensor/maximum_range" ||
                                name == "sensor/field_of_view" ||
                                name.find("population/redraw/") == 0 ||  // it has none
                                name.find("log_odds") != std::string::npos;
    if (!concerns_it || is_without_use) continue;
    EXPECT_EQ(values.count(name), 1u)
        << "the preset kwak2008 does not say what " << name << " is in the filter of the paper";
  }
}

TEST(CompensationStudy, RunsFiltersOnTheSameDrives) {
  CompensationStudyOptions options;
  options.base = kwak2008_options();
  options.variants =
      compensation_variants({"NR", "RSR", "systematic", "compensation", "compensation T_N=1"});
  options.drives = 3;
  const World world = load_world("indoor_two_loops");
  std::uint64_t last = 0;
  const CompensationStudy study = run_compensation_study(load_world("indoor_two_loops"), options,
                                                         [&](std::uint64_t done) { last = done; });
  EXPECT_EQ(last, 3u);  // drives
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
    // Kwak (2008) section 5.2: T_N = 1 means after each observation.
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
  options.base = kwak2008_options();
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
  for (json& row : result["summary"]) row.erase("processor_ms");
  return result;
}

TEST(CompensationProgram, GivesTheSameFiguresWithOneAndTwoJobs) {
  const TemporaryDirectory directory;
  for (const char* jobs : {"1", "2"}) {
    const ProgramResult result = run_program(
        "study compensation --seeds 4 --variants 'RSR,compensation,compensation 20 %' --jobs " +
        std::string(jobs) + " --csv " + directory.file(jobs) + " --json " +
        directory.file(std::string(jobs) + ".json"));
    ASSERT_EQ(result.exit_code, 0) << result.error;
    EXPECT_EQ(result.error, "");
    EXPECT_TRUE(contains(result.out, "\ncompensation 20 % ")) << result.out;
  }
  EXPECT_EQ(read_file(directory.file("1")), read_file(directory.file("2")));
  const json one = figures_of(directory.file("1.json"));
  EXPECT_EQ(one.dump(), figures_of(directory.file("2.json")).dump());
  ASSERT_EQ(one["summary"].size(), 3u);
  EXPECT_EQ(one["summary"][2]["settings"]["population/compensation/ratio"], "1");
  ASSERT_EQ(one["runs"].size(), 12u);
  EXPECT_NE(one["runs"][0]["feature_error"], one["runs"][4]["feature_error"]);
  // Paired by drive, so the mean of the differences is the difference of the means.
  const json& rsr = one["summary"][0];
  const json& full = one["summary"][2];
  EXPECT_EQ(rsr.count("map_error_minus_RSR"), 0u);
  EXPECT_NEAR(full["map_error_minus_RSR"]["mean"].get<double>(),
              full["map_error"]["mean"].get<double>() - rsr["map_error"]["mean"].get<double>(),
              1e-12);
}

TEST(CompensationProgram, TakesOtherWorldsAndSettingsAndSaysSo) {
  const ProgramResult result =
      run_program("study compensation --seeds 2 --variants RSR --set particles=20");
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_TRUE(contains(result.out, "settings: particles = 20\n")) << result.out;
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
