#include "src/configuration/configuration.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <functional>
#include <memory>
#include <sstream>
#include <string>

#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"
#include "fastslam_node/fastslam_pipeline.hpp"
#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "pf_resampling_core/test/temporary_directory.hpp"
#include "test/places.hpp"
#include "tools/common/files.hpp"

namespace pf_resampling {
namespace {

std::string error_of(const std::string& yaml) {
  return refusal([&] {
    BeaconMclPipelineOptions options;
    apply(parse_configuration(yaml, "file.yaml"), &options);
  });
}

void expect_words(const std::string& text, const std::vector<std::string>& words) {
  EXPECT_FALSE(says(text, "\n"));
  for (const std::string& word : words) {
    EXPECT_TRUE(says(text, word));
  }
}

// None of these may end or hold up who reads it.
TEST(Configuration, AKeyThatIsThereTwiceIsRefused) {
  expect_words(error_of("seed: 1\nparticles: 5\nseed: 2\n"), {"file.yaml:3", "'seed'", "twice"});
  expect_words(error_of("population: {threshold: 0.1, threshold: 0.2}"),
               {"'population/threshold'", "twice"});
  // The same key in maps of their own.
  EXPECT_EQ(error_of("beacons: [{id: 1, x: 0, y: 0}, {id: 2, x: 1, y: 0}]\nseed: 1\n"), "");
  EXPECT_EQ(error_of("---\nseed: 1\n...\n"), "");
}

std::string error_of_file(const std::string& path) {
  return refusal([&] { read_configuration(path); });
}

TEST(Configuration, APipeOrADeviceIsRefused) {
  const TemporaryDirectory directory;
  const std::string fifo = directory.file("fifo");
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  for (const std::string& path : {std::string("/dev/zero"), fifo, directory.path()}) {
    expect_words(error_of_file(path), {path + ": cannot be read, it is no regular file"});
  }
}

// --config <(command)
TEST(Configuration, APipeThatIsOpenIsRead) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const std::string text = "seed: 7\n";
  ASSERT_EQ(write(ends[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
  close(ends[1]);
  EXPECT_EQ(read_configuration("/dev/fd/" + std::to_string(ends[0])).values.at("seed"), "7");
  close(ends[0]);
}

TEST(Configuration, ManyBeaconsAreReadAtOnce) {
  std::string text = "beacons:\n";
  for (int i = 0; i < 20000; ++i) text += "- {id: " + std::to_string(i) + ", x: 0, y: 0}\n";
  EXPECT_EQ(parse_configuration(text, "file.yaml").beacons.size(), 20000u);
  expect_words(error_of(text + "- {id: 7, x: 0, y: 0}\n"),
               {"file.yaml:20002: 'beacons', element 20000: beacon 7 appears twice"});
}

TEST(Configuration, ReadsGroupsAndLists) {
  const Configuration configuration = parse_configuration(R"(
particles: 300
population: {resampling: {scheme: ssp}}
beacons: [{id: 7, x: 1.5, y: -2}, {id: 8, x: 0, y: 0, z: 3}]
calibration: [{beacon: -1, scale: 1.1}, {beacon: 7, scale: 1.07, bias: 0.01, sigma: 0.56}]
antennas: [{frame: radio, x: 0.1, y: 0.2, z: 0.3}]
)",
                                                          "file.yaml");
  EXPECT_EQ(configuration.values.at("particles"), "300");
  EXPECT_EQ(configuration.values.at("population/resampling/scheme"), "ssp");
  ASSERT_EQ(configuration.beacons.size(), 2u);
  EXPECT_EQ(configuration.beacons[0].id, 7);
  EXPECT_TRUE(configuration.beacons[0].is_planar);
  EXPECT_FALSE(configuration.beacons[1].is_planar);
  EXPECT_EQ(configuration.beacons[1].position, Eigen::Vector3d(0, 0, 3));
  EXPECT_DOUBLE_EQ(configuration.calibration.at(-1).scale, 1.1);
  EXPECT_DOUBLE_EQ(configuration.calibration.at(7).bias, 0.01);
  EXPECT_DOUBLE_EQ(configuration.calibration.at(7).sigma, 0.56);
  EXPECT_EQ(configuration.antennas.at("radio"), Eigen::Vector3d(0.1, 0.2, 0.3));
}

TEST(Configuration, TheParameterServerGivesTheSame) {
  XmlRpc::XmlRpcValue parameters;
  parameters["particles"] = 300;
  parameters["population"]["threshold"] = 0.1 + 0.2;
  parameters["population"]["resampling"]["scheme"] = "ssp";
  parameters["recovery"]["enabled"] = false;
  // YAML 1.1 turns the word off into a boolean.
  parameters["calibration"]["estimation"] = false;
  parameters["beacons"][0]["id"] = 7;
  parameters["beacons"][0]["x"] = 1.5;
  parameters["beacons"][0]["y"] = -2;
  const Configuration configuration = configuration_of(parameters);
  ASSERT_EQ(configuration.beacons.size(), 1u);
  EXPECT_EQ(configuration.beacons[0].position, Eigen::Vector3d(1.5, -2, 0));
  BeaconMclPipelineOptions options;
  apply(configuration, &options);
  EXPECT_EQ(options.filter.particles, 300);
  EXPECT_EQ(options.filter.strategy.threshold, 0.1 + 0.2);
  EXPECT_EQ(options.filter.strategy.resampling.scheme, ResamplingScheme::ssp);
  EXPECT_FALSE(options.filter.recovery.enabled);
  EXPECT_EQ(options.filter.calibration.estimation, CalibrationEstimation::off);
}

// Anybody may have put anything there.
TEST(Configuration, WhatTheParameterServerGivesInVainIsNamed) {
  const auto error_of_server = [](const std::function<void(XmlRpc::XmlRpcValue*)>& set) {
    XmlRpc::XmlRpcValue parameters;
    set(&parameters);
    return refusal([&] { configuration_of(parameters); });
  };
  using Value = XmlRpc::XmlRpcValue;
  expect_words(error_of_server([](Value* value) { (*value)["particles"][0] = 3; }),
               {"parameter 'particles'", "not a number, a word, true or false"});
  expect_words(error_of_server([](Value* value) { (*value)["beacons"] = 3; }),
               {"parameter 'beacons' has to be a list"});
  expect_words(error_of_server([](Value* value) { (*value)["beacons"][0] = 3; }),
               {"parameter 'beacons', element 0", "an element has to be {key: value, ...}"});
  expect_words(error_of_server([](Value* value) {
                 (*value)["beacons"][0]["id"][0] = 3;
                 for (const char* key : {"x", "y"}) (*value)["beacons"][0][key] = 0;
               }),
               {"parameter 'beacons', element 0: id is 'a list'"});
}

TEST(Configuration, LaterFilesWin) {
  BeaconMclPipelineOptions options;
  apply(parse_configuration("particles: 1\nseed: 2\ncalibration: [{beacon: 1, scale: 1.1}]", "a"),
        &options);
  apply(parse_configuration("seed: 3\ncalibration: [{beacon: 2, scale: 1.2}]", "b"), &options);
  EXPECT_EQ(options.filter.particles, 1);
  EXPECT_EQ(options.seed, 3);
  EXPECT_EQ(options.calibration.size(), 2u);
}

TEST(Configuration, EachMistakeIsNamedWithItsPlace) {
  expect_words(error_of("partcles: 3"), {"partcles", "particles"});
  expect_words(error_of("a: 1\nbeacons: {id: 1}"), {"file.yaml:2", "beacons", "list"});
  expect_words(error_of("beacons:\n- {id: 1, x: 0}"), {"file.yaml:2", "beacons", "'y'", "missing"});
  expect_words(error_of("beacons:\n- {id: 1, x: 0, y: .nan}"), {"file.yaml:2", "y", "finite"});
  expect_words(error_of("beacons:\n- {id: 1.5, x: 0, y: 0}"), {"id", "1.5", "integer"});
  expect_words(error_of("beacons:\n- {id: 1, x: 0, y: 0}\n- {id: 1, x: 0, y: 0}"),
               {"file.yaml:3", "1", "twice"});
  expect_words(error_of("beacons:\n- {id: 1, x: 0, y: 0, q: 1}"),
               {"'q'", "id, x, y and, if wanted, frame, sigma, z"});
  expect_words(error_of("calibration: [{beacon: 1, scale: 0}]"), {"scale", "above 0"});
  expect_words(error_of("beacons: [{id: 1, x: 0, y: 0, sigma: -1}]"), {"sigma", "0 or more"});
  expect_words(error_of("particles: [1, 2]"), {"file.yaml:1", "particles"});
  expect_words(error_of("particles: 1\n  x: {"), {"file.yaml:", "YAML"});
  expect_words(error_of("frames: {map: ''}"), {"frames/map", "empty"});
  expect_words(error_of("beacons: [{[1]: 2}]"), {"unknown key 'a list'"});
  for (const char* const element : {"3", "[1, 2]"}) {
    expect_words(error_of(std::string("beacons:\n- ") + element),
                 {"file.yaml:2", "beacons", "an element has to be {key: value, ...}"});
  }
  EXPECT_THROW(parse_assignment("particles"), Error);
  EXPECT_THROW(read_configuration("/nowhere/at/all.yaml"), Error);
}

// The parameters as text of either filter, in one of two forms.
template <typename Options>
std::string defaults_as(std::string (*text)(const ParameterList&)) {
  Options options;
  return text(parameters_of(&options));
}

template <typename Options>
std::string text_of_all(Options* options) {
  return to_yaml(parameters_of(options));
}

template <typename Options>
void expect_shipped(const std::string& name) {
  const std::string path = std::string(kSourceFolder) + "/config/" + name;
  const std::string shipped = read_file(path);
  const std::string expected = defaults_as<Options>(to_template);
  const std::size_t begin = shipped.find(expected.substr(0, expected.find('\n')));
  ASSERT_NE(begin, std::string::npos);
  EXPECT_TRUE(shipped.substr(begin) == expected)
      << "the parameters changed: scripts/write_config writes " << name << " anew";
  // And it can be read, and sets nothing.
  Options options;
  apply(read_configuration(path), &options);
  EXPECT_EQ(text_of_all(&options), text_of_all(std::make_unique<Options>().get()));
  EXPECT_TRUE(options.given.empty());
  // What is taken in of it can be, each line by itself: the default.
  std::istringstream lines(expected);
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("# ", 0) == 0) continue;
    ASSERT_EQ(line[0], '#');
    Options same;
    apply(parse_configuration(line.substr(1), name), &same);
    EXPECT_EQ(same.given.size(), 1u) << line;
    EXPECT_EQ(text_of_all(&same), text_of_all(&options)) << line;
  }
}

TEST(Configuration, TheShippedFilesAreWhatTheParametersSay) {
  expect_shipped<BeaconMclPipelineOptions>("beacon_mcl.yaml");
  expect_shipped<FastSlamPipelineOptions>("fastslam.yaml");
}

template <typename Pipeline>
std::string table_of() {
  typename Pipeline::Options options;
  return to_markdown(parameters_of(&options), Pipeline::live_parameters(&options));
}

TEST(Configuration, TheTableSaysWhatARunningNodeTakes) {
  const std::string table = table_of<BeaconMclPipeline>();
  const auto row_of = [&](const std::string& name) {
    const std::size_t begin = table.find("| `" + name + "` |");
    return begin == std::string::npos ? "" : table.substr(begin, table.find('\n', begin) - begin);
  };
  const auto ends_with = [](const std::string& row, const std::string& words) {
    return row.size() > words.size() && row.substr(row.size() - words.size()) == words;
  };
  EXPECT_TRUE(ends_with(row_of("particles"), " live |")) << row_of("particles");
  EXPECT_TRUE(ends_with(row_of("preset"), " live |")) << row_of("preset");
  EXPECT_TRUE(ends_with(row_of("frames/map"), " at start |")) << row_of("frames/map");
  EXPECT_TRUE(ends_with(table.substr(0, table.find('\n')), " changes |")) << table;
}

TEST(Configuration, TheDocumentedTablesAreWhatTheParametersSay) {
  const std::string document = read_file(std::string(kSourceFolder) + "/doc/parameters.md");
  for (const std::string& expected :
       {table_of<BeaconMclPipeline>(), table_of<FastSlamPipeline>()}) {
    EXPECT_TRUE(says(document, expected))
        << "the parameters changed: scripts/write_config writes the table anew";
  }
}

TEST(Configuration, TheDocumentedPresetsAreThoseThereAre) {
  const std::string document = read_file(std::string(kSourceFolder) + "/doc/strategies.md");
  for (const Preset& preset : fastslam_presets()) {
    EXPECT_TRUE(says(document, "| `fastslam` | `" + preset.name + "` |"));
  }
  for (const Preset& preset : beacon_mcl_presets()) {
    EXPECT_TRUE(says(document, "| `beacon_mcl` | `" + preset.name + "` |"));
  }
}

// Each preset by the file of its paper, and by the parameter; in whatever order the user sets
// something himself, that wins.
TEST(Configuration, APresetIsBehindWhatIsSetBesideIt) {
  FastSlamPipelineOptions by_file;
  apply(read_configuration(std::string(kSourceFolder) + "/config/kwak2008.yaml"), &by_file);
  FastSlamPipelineOptions by_name("kwak2008");
  EXPECT_EQ(text_of_all(&by_file), text_of_all(&by_name));
  EXPECT_EQ(by_file.filter.strategy.resampling.scheme, ResamplingScheme::residual_systematic);
  BeaconMclPipelineOptions mahmoud;
  apply(read_configuration(std::string(kSourceFolder) + "/config/mahmoud2012.yaml"), &mahmoud);
  EXPECT_FALSE(mahmoud.filter.recovery.enabled);
  EXPECT_EQ(mahmoud.preset, "mahmoud2012");

  const std::vector<std::string> assignments = {"preset=kwak2008", "particles=300",
                                                "sensor/range_sigma=0.25"};
  for (const std::vector<int>& order : {std::vector<int>{0, 1, 2}, {1, 2, 0}, {2, 0, 1}}) {
    FastSlamPipelineOptions options;
    for (const int i : order) {
      apply(parse_assignment(assignments[static_cast<std::size_t>(i)]), &options);
    }
    EXPECT_EQ(options.filter.particles, 300);
    EXPECT_EQ(options.filter.sensor.range_sigma, 0.25);
    EXPECT_EQ(options.filter.sensor.bearing_sigma, by_name.filter.sensor.bearing_sigma);
    EXPECT_EQ(options.filter.strategy.resampling.scheme, ResamplingScheme::residual_systematic);
  }
  // In one file, too; and the last preset that is named is the one.
  FastSlamPipelineOptions options;
  apply(parse_configuration("particles: 7\npreset: kwak2008", "file"), &options);
  apply(parse_assignment("preset=balanced"), &options);
  EXPECT_EQ(options.filter.particles, 7);
  EXPECT_EQ(options.filter.strategy.renewal, Renewal::redraw);
  EXPECT_EQ(options.filter.sensor.bearing_sigma, FastSlamOptions().sensor.bearing_sigma);
}

TEST(Configuration, AnUnknownPresetIsRefusedWithTheChoices) {
  FastSlamPipelineOptions options;
  EXPECT_EQ(refusal([&] { apply(parse_assignment("preset=best"), &options); }),
            "parameter preset is 'best', has to be one of fast, balanced, kwak2008");
  BeaconMclPipelineOptions beacons;
  EXPECT_THROW(apply(parse_assignment("preset=kwak2008"), &beacons), Error);
}

// Names of files are text that YAML has its own ideas about.
TEST(Configuration, NamesOfFilesSurviveTheWayThroughYaml) {
  for (const std::string file : {"", "lab.map", "my maps/it's: #1", "- x", "null", "a\\b", "-"}) {
    FastSlamPipelineOptions options;
    options.map_file = file;
    const Configuration configuration =
        parse_configuration(to_yaml(parameters_of(&options)), "file");
    FastSlamPipelineOptions read;
    read.map_file = "something else";
    apply(configuration, &read);
    EXPECT_EQ(read.map_file, file);
  }
}

TEST(Configuration, SensorsArePlacedWithOrWithoutATurn) {
  const Configuration configuration = parse_configuration(
      "sensors: [{frame: laser, x: 0.2, y: -0.1, yaw: 1.5}, {frame: camera, x: 1, y: 0}]", "file");
  EXPECT_EQ(configuration.sensors.at("laser").heading, 1.5);
  EXPECT_EQ(configuration.sensors.at("laser").y, -0.1);
  EXPECT_EQ(configuration.sensors.at("camera").heading, 0.0);
  expect_words(error_of("beacons: [{id: 1, pos: [0, 0]}]"),
               {"unknown key 'pos'; the keys are id, x, y and, if wanted, frame, sigma, z"});
  expect_words(error_of("beacons: [{id: 1, x: [0, 0], y: 1}]"), {"x is 'a list'"});
  expect_words(error_of("sensors: [{frame: laser, x: 0.2}]"), {"'y' is missing"});
}

}  // namespace
}  // namespace pf_resampling
