#include "src/node/reconfigure_server.hpp"

#include <gtest/gtest.h>

#include <set>

#include "beacon_mcl_node/pipeline_options.hpp"
#include "fastslam_node/pipeline_options.hpp"
#include "pf_resampling_core/test/says.hpp"

namespace pf_resampling {
namespace {

// Every parameter of the core's description is there once, with its type, in a group of its name.
template <typename Options>
void expect_complete() {
  Options options;
  const ParameterList parameters = parameters_of(&options.filter);
  const dynamic_reconfigure::ConfigDescription description = to_description(parameters);
  std::map<std::string, dynamic_reconfigure::ParamDescription> described;
  std::set<int> ids;
  for (const auto& group : description.groups) {
    EXPECT_TRUE(ids.insert(group.id).second);
    EXPECT_EQ(ids.count(group.parent), 1u) << "the parent of " << group.name << " comes first";
    for (const auto& parameter : group.parameters) {
      EXPECT_TRUE(described.emplace(parameter.name, parameter).second) << parameter.name;
      const std::string prefix = group.name == "Default" ? "" : group.name + "/";
      EXPECT_EQ(parameter.name.rfind(prefix, 0), 0u) << parameter.name << " in " << group.name;
    }
  }
  EXPECT_EQ(described.size(), parameters.size());
  for (const Parameter& parameter : parameters) {
    const auto& text = described[parameter.name].description;
    EXPECT_TRUE(says(text, parameter.help));
    EXPECT_TRUE(says(text, parameter.unit));
    for (const std::string& choice : parameter.choices) {
      EXPECT_TRUE(says(described[parameter.name].edit_method, "'" + choice + "'"));
    }
  }
}

TEST(ReconfigureServer, DescribesEveryParameterOnce) {
  expect_complete<BeaconMclPipelineOptions>();
  expect_complete<FastSlamPipelineOptions>();
}

TEST(ReconfigureServer, RangesAndDefaultsAreThoseOfTheDescription) {
  FastSlamPipelineOptions options("fast");
  const auto description = to_description(parameters_of(&options.filter));
  const auto value = [](const dynamic_reconfigure::Config& config, const std::string& name) {
    return values_of(config).at(name);
  };
  EXPECT_EQ(value(description.min, "population/threshold"), "0");
  EXPECT_EQ(value(description.max, "population/threshold"), "1");
  EXPECT_EQ(value(description.dflt, "population/threshold"), "0.75");
  EXPECT_EQ(value(description.min, "particles"), "1");
  EXPECT_EQ(value(description.dflt, "population/renewal"), "resampling");
  EXPECT_EQ(value(description.dflt, "map/frozen"), "false");
}

// What is shown can be sent back, and means the same.
TEST(ReconfigureServer, ValuesSurviveTheWayThroughMessages) {
  BeaconMclPipelineOptions options;
  options.filter.particles = 1234;
  options.filter.strategy.threshold = 0.1 + 0.2;  // needs all 17 digits
  options.filter.strategy.renewal = Renewal::compensation;
  options.filter.recovery.enabled = false;
  const auto values = values_of(to_config(parameters_of(&options.filter)));
  BeaconMclPipelineOptions read;
  set_parameters(parameters_of(&read.filter), values);
  EXPECT_EQ(read.filter.particles, 1234);
  EXPECT_EQ(read.filter.strategy.threshold, 0.1 + 0.2);
  EXPECT_EQ(read.filter.strategy.renewal, Renewal::compensation);
  EXPECT_FALSE(read.filter.recovery.enabled);
}

}  // namespace
}  // namespace pf_resampling
