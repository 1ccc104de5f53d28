#include "pf_resampling_core/parameters/presets.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/filters/beacon_mcl/presets.hpp"
#include "pf_resampling_core/filters/fastslam/presets.hpp"
#include "pf_resampling_core/test/says.hpp"

namespace pf_resampling {
namespace {

struct PresetSample {
  int count = 5;
  double share = 0.5;
  bool flag = false;
};

ParameterList parameters_of(PresetSample* sample) {
  return {integer_parameter("count", &sample->count, 0, 100, "A count."),
          real_parameter("group/share", &sample->share, 0.0, 1.0, "", "A share."),
          boolean_parameter("flag", &sample->flag, "A switch.")};
}

const PresetList kPresets = {{"plain", "the defaults", {}},
                             {"many", "more of them", {{"count", "50"}}},
                             {"paper", "as in a paper", {{"count", "7"}, {"group/share", "0.10"}}}};

void apply(const std::string& name, const std::set<std::string>& given, PresetSample* sample) {
  PresetSample defaults;
  apply_preset(preset_named(kPresets, name), kPresets, parameters_of(&defaults), given,
               parameters_of(sample));
}

TEST(Presets, StandInPlaceOfTheDefaults) {
  PresetSample sample;
  apply("paper", {}, &sample);
  EXPECT_EQ(sample.count, 7);
  EXPECT_EQ(sample.share, 0.1);
  // Of another preset: what that does not set is a default again.
  apply("many", {}, &sample);
  EXPECT_EQ(sample.count, 50);
  EXPECT_EQ(sample.share, 0.5);
  apply("plain", {}, &sample);
  EXPECT_EQ(sample.count, 5);
}

TEST(Presets, LeaveWhatTheUserGave) {
  PresetSample sample;
  sample.count = 12;
  sample.flag = true;  // no preset sets it
  apply("paper", {"count"}, &sample);
  EXPECT_EQ(sample.count, 12);
  EXPECT_EQ(sample.share, 0.1);
  EXPECT_TRUE(sample.flag);
  EXPECT_EQ(departures_from(preset_named(kPresets, "paper"), parameters_of(&sample)),
            "count is 12 (7 in paper)");
  EXPECT_EQ(departures_from(preset_named(kPresets, "plain"), parameters_of(&sample)), "");
  EXPECT_EQ(sample.count, 12);
}

TEST(Presets, AnUnknownNameIsRefusedWithTheChoices) {
  EXPECT_EQ(refusal([&] { preset_named(kPresets, "best"); }),
            "unknown preset 'best'; known are plain, many, paper");
  std::string name = "plain";
  const ParameterList parameters = {preset_parameter(kPresets, &name)};
  EXPECT_EQ(refusal([&] { set_parameter(parameters, "preset", "best"); }),
            "parameter preset is 'best', has to be one of plain, many, paper");
  EXPECT_EQ(name, "plain");
  set_parameter(parameters, "preset", "many");
  EXPECT_EQ(name, "many");
  for (const Preset& preset : kPresets) {
    EXPECT_TRUE(says(parameters[0].help, preset.name + ": " + preset.meaning));
  }
}

// All presets of a filter make sense, and say no more than they change or a paper says.
template <typename Options>
void expect_sensible(const PresetList& presets, Options (*options_of)(const std::string&)) {
  EXPECT_TRUE(presets.front().values.empty());
  for (const Preset& preset : presets) {
    const Options options = options_of(preset.name);
    EXPECT_NO_THROW(validate(options)) << preset.name;
    Options copy = options;
    EXPECT_EQ(departures_from(preset, parameters_of(&copy)), "") << preset.name;
  }
  EXPECT_THROW(options_of("best"), Error);
}

TEST(Presets, OfTheFiltersMakeSense) {
  expect_sensible(fastslam_presets(), fastslam_options_of);
  expect_sensible(beacon_mcl_presets(), beacon_mcl_options_of);
}

TEST(Presets, FastIsResamplingAndBalancedIsRedraw) {
  const FastSlamOptions fast = fastslam_options_of("fast");
  EXPECT_EQ(fast.strategy.renewal, Renewal::resampling);
  EXPECT_EQ(fast.particles, 1000);
  const FastSlamOptions balanced = fastslam_options_of("balanced");
  EXPECT_EQ(balanced.strategy.renewal, Renewal::redraw);
  EXPECT_EQ(balanced.particles, 100);
  EXPECT_EQ(beacon_mcl_options_of("fast").strategy.renewal, Renewal::resampling);
  EXPECT_EQ(beacon_mcl_options_of("balanced").strategy.renewal, Renewal::redraw);
}

// Mahmoud et al. (2012): nothing is estimated while it runs, and nothing is injected.
TEST(Presets, Mahmoud2012EstimatesNothing) {
  const BeaconMclOptions options = beacon_mcl_options_of("mahmoud2012");
  EXPECT_FALSE(options.recovery.enabled);
  EXPECT_EQ(to_string(options.initialization.method), "uniform");
}

}  // namespace
}  // namespace pf_resampling
