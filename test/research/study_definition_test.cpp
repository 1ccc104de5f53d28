#include "research/studies/study_definition.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "pf_resampling_core/error.hpp"
#include "research/studies/study_trials.hpp"
#include "test/temporary_directory.hpp"

namespace pf_resampling {
namespace {

const char* const kSmall = R"(study: small
filter: fastslam
preset: kwak2008
settings: {particles: 20}
trials: 3
problems:
  - {name: loops, world: indoor_two_loops, duration: 5}
groups:
  - name: Both
    filters:
      - {name: RSR}
      - {name: gentle, settings: {population/renewal: compensation, population/compensation/ratio: 0.2}}
  - name: Gauss
    filters:
      - {name: EKF-SLAM, estimator: ekf_slam}
)";

std::string with(std::string text, const std::string& old, const std::string& changed) {
  const std::size_t at = text.find(old);
  EXPECT_NE(at, std::string::npos) << old;
  return text.replace(at, old.size(), changed);
}

void expect_refused(const std::string& text, const std::vector<std::string>& parts) {
  try {
    parse_study(text, "my.yaml", "");
    FAIL() << text;
  } catch (const Error& error) {
    for (const std::string& part : parts) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  }
}

TEST(StudyDefinition, IsWhatTheFileSays) {
  const StudyDefinition study = parse_study(kSmall, "my.yaml", "folder");
  EXPECT_EQ(study.name, "small");
  EXPECT_EQ(study.title, "small");
  EXPECT_EQ(study.filter, StudiedFilter::fastslam);
  EXPECT_EQ(study.settings, (Settings{{"particles", "20"}}));
  EXPECT_EQ(study.trials, 3);
  EXPECT_EQ(study.reference, "RSR");  // the first, if none is named
  ASSERT_EQ(study.problems.size(), 1u);
  EXPECT_EQ(study.problems[0].world, "indoor_two_loops");
  EXPECT_EQ(study.problems[0].duration, 5.0);
  ASSERT_EQ(study.filters.size(), 3u);
  EXPECT_EQ(study.filters[1].group, "Both");
  EXPECT_EQ(study.filters[1].settings.at("population/compensation/ratio"), "0.2");
  EXPECT_EQ(study.filters[2].estimator, Estimator::ekf_slam);
}

TEST(StudyDefinition, FilesAreBesideTheStudy) {
  const StudyDefinition study = parse_study(
      with(kSmall, "world: indoor_two_loops, duration: 5", "bag: my.bag, config: /etc/my.yaml"),
      "s/my.yaml", "s");
  EXPECT_EQ(study.problems[0].bag, "s/my.bag");
  EXPECT_EQ(study.problems[0].config, "/etc/my.yaml");
}

TEST(StudyDefinition, GivesEveryFilterEachNumberOfParticles) {
  const StudyDefinition study =
      parse_study(std::string(kSmall) + "particles: [50, 100]\n", "my.yaml", "");
  ASSERT_EQ(study.filters.size(), 6u);
  EXPECT_EQ(study.filters[2].name, "gentle M=50");
  EXPECT_EQ(study.filters[3].name, "gentle M=100");
  EXPECT_EQ(study.filters[3].settings.at("particles"), "100");
  EXPECT_EQ(study.reference, "RSR M=50");
}

TEST(StudyDefinition, SaysWhereItMakesNoSense) {
  expect_refused(with(kSmall, "filter: fastslam", "filter: amcl"), {"my.yaml", "line 2", "amcl"});
  expect_refused(with(kSmall, "trials: 3", "trails: 3"), {"my.yaml", "line 5", "trails", "trials"});
  expect_refused(with(kSmall, "trials: 3", "trials: many"), {"line 5", "many", "whole number"});
  expect_refused(with(kSmall, "trials: 3", "trials: 0"), {"my.yaml", "trials is 0"});
  expect_refused(with(kSmall, "world: indoor_two_loops,", "world: a.yaml, bag: b.bag,"),
                 {"line 7", "either a world or a bag"});
  expect_refused(with(kSmall, "name: gentle", "name: RSR"), {"two of the name RSR"});
  expect_refused(with(kSmall, "name: gentle", "name: \"a,b\""), {"a,b", "comma"});
  expect_refused(with(kSmall, "estimator: ekf_slam", "estimator: ukf"), {"ukf", "ekf_slam"});
  expect_refused(std::string(kSmall) + "reference: best\n", {"reference is 'best'"});
  expect_refused(with(kSmall, "{name: RSR}", "{name: RSR, settings: [1]}"), {"settings", "map"});
  expect_refused(with(kSmall, "duration: 5", "calibrated: true"), {"beacon_mcl"});
  expect_refused("study: [", {"my.yaml", "not YAML"});
  EXPECT_THROW(load_study("weather"), Error);
  EXPECT_THROW(load_study("/none/my.yaml"), Error);
}

// What the package's own studies set is there to be set, and makes sense: an experiment of every
// problem can be made.
TEST(StudyDefinition, ThoseOfThePapersCanBeRun) {
  for (const auto& [name, filters] : {std::make_pair("kwak", 90), std::make_pair("mahmoud", 25)}) {
    StudyDefinition study = load_study(name);
    EXPECT_GE(static_cast<int>(study.filters.size()), filters) << name;
    for (StudyProblem& problem : study.problems) {
      if (problem.duration > 0.0) problem.duration = 60.0;  // long enough to calibrate
      EXPECT_NO_THROW(experiment_of(study, problem)) << name << ", " << problem.name;
    }
  }
}

TEST(StudyDefinition, SettingsThatMakeNoSenseNameTheirFilter) {
  StudyDefinition study = parse_study(kSmall, "my.yaml", "");
  const auto expect_refused = [&](const std::string& name, const std::string& value) {
    StudyDefinition changed = study;
    changed.filters[1].settings[name] = value;
    try {
      experiment_of(changed, changed.problems[0]);
      FAIL() << name;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("filter gentle: "), std::string::npos)
          << error.what();
    }
  };
  expect_refused("nothing", "1");
  expect_refused("particles", "-1");
  expect_refused("association/method", "maximum_likelihood");  // eq. 5 goes by ids
  expect_refused("odometry/slip_per_distance", "0.3");         // all are given the same odometry
}

}  // namespace
}  // namespace pf_resampling
