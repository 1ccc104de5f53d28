// Strategies of FastSlamPipeline, and switching between them while it runs.
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "pf_resampling_core/test/temporary_directory.hpp"
#include "test/fastslam_rig.hpp"
#include "tools/common/files.hpp"

namespace pf_resampling {
namespace {

using Drive = FastSlamDrive;

TEST(FastSlamPipeline, BothRenewalsWorkAndSayWhatTheyAre) {
  FastSlamPipelineOptions options = Drive::options();
  options.filter.strategy.schedule = Schedule::every_n;
  options.filter.strategy.every_n = 5;
  options.filter.strategy.renewal = Renewal::resampling;
  options.filter.strategy.resampling.scheme = ResamplingScheme::stratified;
  FastSlamRig resampling(options);
  resampling.feed(Drive::messages(40.0));
  EXPECT_EQ(resampling.out.statuses.back().strategy, "every_n 5, resampling stratified, none");
  EXPECT_LT(resampling.error(), kLost);
  EXPECT_LT(resampling.map_error(), kLost);

  options.filter.strategy.renewal = Renewal::compensation;
  options.filter.strategy.compensation.pairing = Pairing::roulette;
  options.filter.strategy.compensation.ratio = 0.5;
  FastSlamRig compensation(options);
  compensation.feed(Drive::messages(40.0));
  EXPECT_EQ(compensation.out.statuses.back().strategy,
            "every_n 5, compensation roulette 50 %, none");
  EXPECT_LT(compensation.error(), kLost);
  EXPECT_LT(compensation.map_error(), kLost);

  for (const FastSlamRig* run : {&resampling, &compensation}) {
    const auto& statuses = run->out.statuses;
    EXPECT_EQ(statuses.back().updates, statuses.size());
    EXPECT_EQ(statuses.back().renewals, statuses.size() / 5);
    for (std::size_t i = 0; i < statuses.size(); ++i) {
      EXPECT_EQ(static_cast<bool>(statuses[i].renewed), i % 5 == 4) << i;
    }
  }
  // Compensation blends; nobody's line ends.
  EXPECT_EQ(compensation.out.statuses.back().distinct_ancestors_since_start, 60u);
  EXPECT_LT(resampling.out.statuses.back().distinct_ancestors_since_start, 60u);
}

using Values = std::map<std::string, std::string>;

/// Settings that give every choice of every strategy its turn, each followed by the default.
std::vector<Values> all_strategies() {
  FastSlamPipelineOptions defaults = Drive::options();
  std::vector<Values> strategies;
  for (const Parameter& parameter : parameters_of(&defaults.filter)) {
    const auto is_in = [&](const char* group) { return parameter.name.rfind(group, 0) == 0; };
    if (parameter.choices.empty() || !(is_in("population/") || is_in("excitation/"))) continue;
    for (const std::string& choice : parameter.choices) {
      Values values = {{parameter.name, choice}};
      // What belongs to another strategy comes with that.
      if (is_in("population/compensation/")) values["population/renewal"] = "compensation";
      if (is_in("population/resampling/inner_scheme")) {
        values["population/resampling/scheme"] = "rank_based";
      }
      if (is_in("population/resampling/weights_after")) {
        values["population/resampling/scheme"] = "partial";
      }
      strategies.push_back(values);
      Values back;
      for (const Parameter& other : parameters_of(&defaults.filter)) {
        if (values.count(other.name) > 0) back[other.name] = other.get();
      }
      strategies.push_back(back);
    }
  }
  return strategies;
}

// All particles with their weights and landmarks are in the file of a map, to the last bit: a
// filter that loads it goes on as if nothing had happened.
TEST(FastSlamPipeline, ASwitchOfStrategyLeavesEveryParticleAndLandmarkAsItIs) {
  const TemporaryDirectory directory;
  const auto strategies = all_strategies();
  ASSERT_GE(strategies.size(), 50u);
  FastSlamPipelineOptions options = Drive::options();
  options.filter.strategy.threshold = 1.0;  // renews with every scan
  FastSlamRig run(options);
  const auto contents = [&] {
    run.pipeline.save_map(directory.file("map"));
    return read_file(directory.file("map"));
  };
  double seconds = 10.0;
  run.feed(Drive::messages(seconds));
  std::string last;
  for (const Values& strategy : strategies) {
    SCOPED_TRACE(strategy.begin()->first + " = " + strategy.begin()->second);
    const std::string before = contents();
    EXPECT_FALSE(before == last) << "nothing happened";
    const FastSlamParticles particles = run.pipeline.filter().particles();
    run.pipeline.set_parameters(strategy);
    EXPECT_TRUE(same_particles(particles, run.pipeline.filter().particles()));
    last = contents();
    EXPECT_TRUE(before == last);

    run.feed(Drive::messages(seconds + 0.1, seconds + 1.0));
    seconds += 1.0;
    EXPECT_LT(run.error(), kLost);
  }
  EXPECT_EQ(run.out.maps.back().landmarks.size(), 12u);
  EXPECT_LT(run.map_error(), kLost);
  EXPECT_EQ(run.out.statuses.back().weight_resets, 0u);
  EXPECT_EQ(run.pipeline.rejects().total(), 0u);
}

TEST(FastSlamPipeline, ASwitchAndBackIsAsIfNothingHadHappened) {
  const auto drive = Drive::messages(20.0);
  FastSlamRig good;
  good.feed(drive);
  FastSlamRig run;
  const auto strategies = all_strategies();
  std::size_t next = 0;
  for (const FastSlamMessage& message : drive) {
    handle(message, &run.pipeline);
    for (int i = 0; i < 2; ++i) {
      run.pipeline.set_parameters(strategies[next++ % strategies.size()]);
    }
  }
  EXPECT_GT(next, 2 * strategies.size());
  EXPECT_TRUE(same_bytes(run.out.poses, good.out.poses));
  EXPECT_TRUE(same_bytes(run.out.maps, good.out.maps));
  EXPECT_TRUE(same_bytes(run.out.clouds, good.out.clouds));
}

TEST(FastSlamPipeline, IdsAreNotTakenForAMapThatWasMadeWithoutThem) {
  FastSlamPipelineOptions options = Drive::options();
  options.filter.association.method = DataAssociation::mutual_exclusion;
  FastSlamRig run(options);
  FastSlamRig good(options);
  const auto start = Drive::messages(10.0);
  run.feed(start);
  good.feed(start);
  EXPECT_THROW(run.pipeline.set_parameters(
                   {{"association/method", "known"}, {"population/renewal", "compensation"}}),
               Error);
  // Old values stay and are shown, with the reason.
  for (const Parameter& parameter : run.pipeline.live_parameters()) {
    if (parameter.name == "association/method") {
      EXPECT_EQ(parameter.get(), "mutual_exclusion");
    } else if (parameter.name == "population/renewal") {
      EXPECT_EQ(parameter.get(), "resampling");
    }
  }
  const auto rest = Drive::messages(10.1, 20.0);
  run.feed(rest);
  good.feed(rest);
  EXPECT_TRUE(says(run.out.statuses.back().refused, "association/method"));
  EXPECT_TRUE(same_bytes(run.out.poses, good.out.poses));
  EXPECT_EQ(run.out.statuses.back().strategy, good.out.statuses.back().strategy);
}

// A preset that is chosen live sets what no configuration gave; other values beside it win.
TEST(FastSlamPipeline, PresetsSwitchWhileItRuns) {
  FastSlamPipelineOptions options = Drive::options();
  apply(parse_assignment("sensor/range_sigma=0.125"), &options);
  FastSlamRig run(options);
  run.feed(Drive::messages(5.0));
  const auto value = [&](const std::string& name) {
    for (const Parameter& parameter : run.pipeline.live_parameters()) {
      if (parameter.name == name) return parameter.get();
    }
    return "there is no " + name;
  };
  EXPECT_EQ(run.pipeline.live_parameters().front().name, "preset");
  run.pipeline.set_parameters({{"preset", "balanced"}});
  EXPECT_EQ(value("preset"), "balanced");
  EXPECT_EQ(value("population/renewal"), "redraw");
  EXPECT_EQ(value("particles"), "100");
  run.feed(Drive::messages(5.1, 10.0));
  EXPECT_EQ(run.out.statuses.back().particles, 100u);
  EXPECT_GT(run.out.statuses.back().redraws, 0u);

  run.pipeline.set_parameters({{"preset", "kwak2008"}, {"population/renewal", "compensation"}});
  EXPECT_EQ(value("population/renewal"), "compensation");
  EXPECT_EQ(value("population/resampling/scheme"), "residual_systematic");
  EXPECT_EQ(value("sensor/range_sigma"), "0.125");
  const std::string& note = run.out.log[run.out.log.size() - 2];
  EXPECT_TRUE(says(note, "population/renewal is compensation (resampling in kwak2008)"));
  EXPECT_TRUE(says(note, "sensor/range_sigma is 0.125 (0.1 in kwak2008)"));

  // A client that sends everything, of which the preset alone is new.
  Values all;
  for (const Parameter& parameter : run.pipeline.live_parameters()) {
    all[parameter.name] = parameter.get();
  }
  all["preset"] = "fast";
  run.pipeline.set_parameters(all);
  EXPECT_EQ(value("population/renewal"), "resampling");
  EXPECT_EQ(value("particles"), "1000");
  EXPECT_EQ(value("population/resampling/scheme"), "systematic");
  // The same again, with something else that is new: the preset does not undo it.
  all["population/renewal"] = "compensation";
  all["particles"] = "60";
  run.pipeline.set_parameters(all);
  EXPECT_EQ(value("population/renewal"), "compensation");
  // Alone it is chosen anew.
  run.pipeline.set_parameters({{"preset", "fast"}});
  EXPECT_EQ(value("population/renewal"), "resampling");

  EXPECT_THROW(run.pipeline.set_parameters({{"preset", "best"}, {"particles", "5"}}), Error);
  EXPECT_EQ(value("preset"), "fast");
  EXPECT_EQ(value("particles"), "1000");
  run.feed(Drive::messages(10.1, 12.0));
  EXPECT_TRUE(says(run.out.statuses.back().refused, "fast, balanced, kwak2008"));
}

// Resampling leaves few histories of the start, and the map's past hangs on these. Redraws bring
// them back, and a map that is done needs none.
TEST(FastSlamPipeline, SaysThatTheMapsPastIsDepleted) {
  FastSlamPipelineOptions options = Drive::options();
  options.filter.strategy.threshold = 1.0;  // renews with every scan
  FastSlamRig run(options);
  run.feed(Drive::messages(60.0));
  const FilterStatus& depleted = run.out.statuses.back();
  EXPECT_LT(depleted.distinct_ancestors_since_start, 0.1 * depleted.particles);
  EXPECT_EQ(depleted.health, "depleted");
  EXPECT_TRUE(says(depleted.health_text, "redraw"));
  const auto& entry = run.out.diagnostics.back().status[0];
  EXPECT_EQ(entry.level, diagnostic_msgs::DiagnosticStatus::WARN);
  EXPECT_TRUE(says(entry.message, "particle diversity is nearly gone"));

  run.pipeline.set_parameters({{"map/frozen", "true"}});
  run.feed(Drive::messages(60.1, 62.0));
  EXPECT_EQ(run.out.statuses.back().health, "healthy");
  run.pipeline.set_parameters({{"map/frozen", "false"}, {"population/renewal", "redraw"}});
  run.feed(Drive::messages(62.1, 64.0));
  EXPECT_EQ(run.out.statuses.back().health, "healthy");
}

}  // namespace
}  // namespace pf_resampling
